use std::sync::Arc;

/// Bytes that an asset keeps. The first of an asset's buffers is the file that was opened, unpacked; others are files that it
/// refers to by name.
#[derive(Clone, Debug)]
pub(crate) struct Buffer {
    /// The file's name in the folder of the first; empty for the first itself.
    pub(crate) name: String,
    /// Shared by clones until one of them is written to.
    pub(crate) bytes: Arc<Vec<u8>>,
}

impl Buffer {
    /// The file that was opened.
    pub(crate) fn file(bytes: Vec<u8>) -> Self {
        Self {
            name: String::new(),
            bytes: Arc::new(bytes),
        }
    }

    /// Whether its bytes stand in the file that was opened, if only encoded in its text.
    pub(crate) fn is_file(&self) -> bool {
        self.name.is_empty()
    }

    /// Whether two are clones of which neither was written to.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.bytes, &other.bytes)
    }
}

impl AsRef<[u8]> for Buffer {
    fn as_ref(&self) -> &[u8] {
        &self.bytes
    }
}
