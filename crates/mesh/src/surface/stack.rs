/// What is still to visit, the next last, without an allocation.
pub(super) struct Stack<T, const SIZE: usize> {
    pub(super) items: [T; SIZE],
    pub(super) len: usize,
}

impl<T: Copy, const SIZE: usize> Stack<T, SIZE> {
    /// Empty; `filler` stands where nothing is.
    #[inline(always)]
    pub(super) fn new(filler: T) -> Self {
        let items = [filler; SIZE];
        Self { items, len: 0 }
    }

    #[inline(always)]
    pub(super) fn push(&mut self, item: T) {
        self.items[self.len] = item;
        self.len += 1;
    }

    #[inline(always)]
    pub(super) fn pop(&mut self) -> Option<T> {
        self.len = self.len.checked_sub(1)?;
        Some(self.items[self.len])
    }
}
