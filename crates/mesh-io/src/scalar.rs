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

/// An expression for the type T that a scalar stands for.
macro_rules! of_type {
    ($scalar:expr, $T:ident => $expression:expr) => {
        of_type!($scalar, $T => $expression, I8 i8, U8 u8, I16 i16, U16 u16, I32 i32, U32 u32, F32 f32, F64 f64)
    };
    ($scalar:expr, $T:ident => $expression:expr, $($variant:ident $type:ty),*) => {
        match $scalar {
            $(Self::$variant => {
                type $T = $type;
                $expression
            })*
        }
    };
}

// Of the eight types, one needs no conversion to f64.
#[allow(clippy::useless_conversion)]
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
        of_type!(self, T => size_of::<T>())
    }

    pub(crate) fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }

    /// The number at `at`; f64 holds each of these types exactly. `None` beyond the end.
    pub(crate) fn read(self, bytes: &[u8], at: usize, endian: Endian) -> Option<f64> {
        of_type!(self, T => {
            let raw = bytes.get(at..at.checked_add(size_of::<T>())?)?.try_into().ok()?;
            Some(f64::from(match endian {
                Endian::Little => T::from_le_bytes(raw),
                Endian::Big => T::from_be_bytes(raw),
            }))
        })
    }

    /// Overwrites the number at `at`, which must be there, by one that this type holds.
    pub(crate) fn write(self, number: f64, bytes: &mut [u8], at: usize, endian: Endian) {
        of_type!(self, T => {
            let raw = match endian {
                Endian::Little => (number as T).to_le_bytes(),
                Endian::Big => (number as T).to_be_bytes(),
            };
            bytes[at..at + raw.len()].copy_from_slice(&raw);
        });
    }

    /// The greatest number of the type.
    pub(crate) fn greatest(self) -> f64 {
        of_type!(self, T => f64::from(T::MAX))
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
