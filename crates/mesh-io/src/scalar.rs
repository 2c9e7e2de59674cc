/// A number type of a binary file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

/// The order of a number's bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Endian {
    Little,
    Big,
}

impl Scalar {
    /// The type that a PLY header names, by its old or its sized name.
    pub(crate) fn of_name(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }

    /// In bytes.
    pub(crate) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    pub(crate) fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }

    /// The number at `at`; f64 holds each of these types exactly. `None` beyond the end.
    pub(crate) fn read(self, bytes: &[u8], at: usize, endian: Endian) -> Option<f64> {
        let big = endian == Endian::Big;
        macro_rules! read {
            ($type:ty) => {{
                let raw = bytes
                    .get(at..at.checked_add(size_of::<$type>())?)?
                    .try_into()
                    .ok()?;
                f64::from(if big {
                    <$type>::from_be_bytes(raw)
                } else {
                    <$type>::from_le_bytes(raw)
                })
            }};
        }
        Some(match self {
            Self::I8 => read!(i8),
            Self::U8 => read!(u8),
            Self::I16 => read!(i16),
            Self::U16 => read!(u16),
            Self::I32 => read!(i32),
            Self::U32 => read!(u32),
            Self::F32 => read!(f32),
            Self::F64 => read!(f64),
        })
    }

    /// Overwrites the number at `at`, which must be there, by one that this type holds.
    pub(crate) fn write(self, number: f64, bytes: &mut [u8], at: usize, endian: Endian) {
        macro_rules! write {
            ($type:ty) => {{
                let raw = match endian {
                    Endian::Little => (number as $type).to_le_bytes(),
                    Endian::Big => (number as $type).to_be_bytes(),
                };
                bytes[at..at + raw.len()].copy_from_slice(&raw);
            }};
        }
        match self {
            Self::I8 => write!(i8),
            Self::U8 => write!(u8),
            Self::I16 => write!(i16),
            Self::U16 => write!(u16),
            Self::I32 => write!(i32),
            Self::U32 => write!(u32),
            Self::F32 => write!(f32),
            Self::F64 => write!(f64),
        }
    }

    /// The greatest number of the type.
    pub(crate) fn greatest(self) -> f64 {
        match self {
            Self::I8 => i8::MAX.into(),
            Self::U8 => u8::MAX.into(),
            Self::I16 => i16::MAX.into(),
            Self::U16 => u16::MAX.into(),
            Self::I32 => i32::MAX.into(),
            Self::U32 => u32::MAX.into(),
            Self::F32 => f32::MAX.into(),
            Self::F64 => f64::MAX,
        }
    }

    /// The least number of the type.
    pub(crate) fn least(self) -> f64 {
        match self {
            Self::U8 | Self::U16 | Self::U32 => 0.0,
            Self::I8 | Self::I16 | Self::I32 => -self.greatest() - 1.0,
            Self::F32 | Self::F64 => -self.greatest(),
        }
    }
}
