//! A priority queue of vertices by integer gain: an array of doubly linked lists (Fiduccia and Mattheyses 1982).
//!
//! Insertion, removal and change of key are O(1); the newest vertex of a bucket comes out first, which keeps a local
//! search together. When gains span more than `MAX_BUCKETS`, neighbouring gains share a bucket.
//! Cost: 12 bytes a vertex, touched only where used.

/// Ids are stored plus one, so that 0 means "none" and fresh arrays are zero pages.
const NONE: u32 = 0;
const MAX_BUCKETS: usize = 4096;

pub(crate) struct GainBuckets {
    heads: Vec<u32>,
    next: Vec<u32>,
    previous: Vec<u32>,
    /// Bucket of each queued vertex, plus one.
    bucket: Vec<u32>,
    top: usize,
    len: usize,
    max_gain: i32,
    shift: u32,
}

impl GainBuckets {
    /// For vertices `0..count` with gains in `-max_gain..=max_gain`.
    pub(crate) fn new(count: usize, max_gain: i32) -> Self {
        let mut queue = Self {
            heads: Vec::new(),
            next: vec![NONE; count],
            previous: vec![NONE; count],
            bucket: vec![NONE; count],
            top: 0,
            len: 0,
            max_gain,
            shift: 0,
        };
        queue.set_max_gain(max_gain);
        queue
    }

    /// Prepares the queue, which must be empty, for gains in `-max_gain..=max_gain`.
    pub(crate) fn set_max_gain(&mut self, max_gain: i32) {
        let span = 2 * i64::from(max_gain) + 1;
        self.max_gain = max_gain;
        self.shift = (0..).find(|s| (span >> s) < MAX_BUCKETS as i64).unwrap_or(0);
        self.heads.clear();
        self.heads.resize((span >> self.shift) as usize + 1, NONE);
        self.top = 0;
    }

    pub(crate) fn contains(&self, vertex: usize) -> bool {
        self.bucket[vertex] != NONE
    }

    pub(crate) fn insert(&mut self, vertex: usize, gain: i32) {
        let bucket = self.bucket_of(gain);
        self.link(vertex, bucket);
        self.len += 1;
    }

    /// Inserts the vertex or moves it to another gain.
    pub(crate) fn set(&mut self, vertex: usize, gain: i32) {
        if !self.contains(vertex) {
            return self.insert(vertex, gain);
        }
        let bucket = self.bucket_of(gain);
        if self.bucket[vertex] as usize != bucket + 1 {
            self.unlink(vertex);
            self.link(vertex, bucket);
        }
    }

    pub(crate) fn remove(&mut self, vertex: usize) {
        if self.contains(vertex) {
            self.unlink(vertex);
            self.bucket[vertex] = NONE;
            self.len -= 1;
        }
    }

    /// A vertex of greatest gain.
    pub(crate) fn peek(&mut self) -> Option<usize> {
        if self.len == 0 {
            self.top = 0;
            return None;
        }
        while self.heads[self.top] == NONE {
            self.top -= 1;
        }
        Some(self.heads[self.top] as usize - 1)
    }

    pub(crate) fn pop(&mut self) -> Option<usize> {
        let vertex = self.peek()?;
        self.remove(vertex);
        Some(vertex)
    }

    pub(crate) fn clear(&mut self) {
        while self.pop().is_some() {}
    }

    fn bucket_of(&self, gain: i32) -> usize {
        ((i64::from(gain) + i64::from(self.max_gain)) >> self.shift) as usize
    }

    fn link(&mut self, vertex: usize, bucket: usize) {
        let head = self.heads[bucket];
        self.next[vertex] = head;
        self.previous[vertex] = NONE;
        if head != NONE {
            self.previous[head as usize - 1] = vertex as u32 + 1;
        }
        self.heads[bucket] = vertex as u32 + 1;
        self.bucket[vertex] = bucket as u32 + 1;
        self.top = self.top.max(bucket);
    }

    fn unlink(&mut self, vertex: usize) {
        let (next, previous) = (self.next[vertex], self.previous[vertex]);
        if next != NONE {
            self.previous[next as usize - 1] = previous;
        }
        if previous == NONE {
            self.heads[self.bucket[vertex] as usize - 1] = next;
        } else {
            self.next[previous as usize - 1] = next;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_come_out_by_gain_and_the_newest_of_equals_first() {
        let mut queue = GainBuckets::new(5, 10);
        for (vertex, gain) in [(0, -10), (1, 3), (2, 10), (3, 3), (4, 0)] {
            queue.insert(vertex, gain);
        }
        queue.set(0, 4);
        queue.remove(4);
        assert_eq!(
            std::iter::from_fn(|| queue.pop()).collect::<Vec<_>>(),
            [2, 0, 3, 1]
        );
        assert!(!queue.contains(2));
    }

    #[test]
    fn gains_of_any_size_keep_their_order_up_to_the_width_of_a_bucket() {
        let mut queue = GainBuckets::new(3, i32::MAX);
        queue.insert(0, -i32::MAX);
        queue.insert(1, i32::MAX);
        queue.insert(2, 0);
        assert_eq!(std::iter::from_fn(|| queue.pop()).collect::<Vec<_>>(), [1, 2, 0]);
    }
}
