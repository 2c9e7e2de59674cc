use crate::error::Fault;

/// Walks over the words of a text, line by line, without copying them.
///
/// Lines end with LF, CR LF or CR; `#` begins a comment that lasts to the end of its line.
#[derive(Clone)]
pub(crate) struct Words<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Whether a backslash at the end of a line joins the next one to it (OBJ).
    continues: bool,
}

/// A word and where it begins.
#[derive(Clone, Copy)]
pub(crate) struct Word<'a> {
    pub(crate) start: usize,
    pub(crate) text: &'a [u8],
}

impl<'a> Words<'a> {
    pub(crate) fn new(bytes: &'a [u8], at: usize) -> Self {
        let continues = false;
        Self { bytes, at, continues }
    }

    pub(crate) fn with_continued_lines(bytes: &'a [u8], at: usize) -> Self {
        let continues = true;
        Self { bytes, at, continues }
    }

    /// Where the next word is sought.
    pub(crate) fn position(&self) -> usize {
        self.at
    }

    /// Lets the next word be `word` once more.
    pub(crate) fn go_back_to(&mut self, word: Word<'_>) {
        self.at = word.start;
    }

    pub(crate) fn fault(&self, problem: impl Into<String>) -> Fault {
        Fault::at_line(self.bytes, self.at, problem)
    }

    pub(crate) fn fault_at(&self, word: Word<'_>, problem: impl Into<String>) -> Fault {
        Fault::at_line(self.bytes, word.start, problem)
    }

    /// The next word of this line.
    pub(crate) fn next_in_line(&mut self) -> Option<Word<'a>> {
        loop {
            match *self.bytes.get(self.at)? {
                b'\n' | b'\r' | b'#' => return None,
                b if is_blank(b) => self.at += 1,
                b'\\' if self.joined_line() > 0 => self.at += self.joined_line(),
                _ => break,
            }
        }
        let start = self.at;
        while let Some(&b) = self.bytes.get(self.at)
            && !ends_word(b)
            && !(b == b'\\' && self.joined_line() > 0)
        {
            self.at += 1;
        }
        Some(Word {
            start,
            text: &self.bytes[start..self.at],
        })
    }

    /// The first word of this line or of the first later line that has one; `None` at the end of the file.
    pub(crate) fn next_anywhere(&mut self) -> Option<Word<'a>> {
        loop {
            if let Some(word) = self.next_in_line() {
                return Some(word);
            }
            if self.at >= self.bytes.len() {
                return None;
            }
            self.skip_line();
        }
    }

    /// To the beginning of the next line.
    pub(crate) fn skip_line(&mut self) {
        while let Some(&b) = self.bytes.get(self.at) {
            match b {
                b'#' => return self.skip_to_line_end(),
                b'\\' if self.joined_line() > 0 => self.at += self.joined_line(),
                b'\n' | b'\r' => return self.skip_to_line_end(),
                _ => self.at += 1,
            }
        }
    }

    /// Past the end of this physical line: comments are not continued.
    fn skip_to_line_end(&mut self) {
        let rest = &self.bytes[self.at..];
        self.at += rest
            .iter()
            .position(|&b| b == b'\n' || b == b'\r')
            .unwrap_or(rest.len());
        self.at += line_end(&self.bytes[self.at..]);
    }

    /// Length of the backslash and line end here, 0 if there is none.
    fn joined_line(&self) -> usize {
        match line_end(self.bytes.get(self.at + 1..).unwrap_or(&[])) {
            0 => 0,
            length if self.continues => 1 + length,
            _ => 0,
        }
    }
}

fn line_end(bytes: &[u8]) -> usize {
    match bytes {
        [b'\r', b'\n', ..] => 2,
        [b'\r' | b'\n', ..] => 1,
        _ => 0,
    }
}

fn is_blank(b: u8) -> bool {
    matches!(b, b' ' | b'\t' | 0x0B | 0x0C)
}

fn ends_word(b: u8) -> bool {
    is_blank(b) || matches!(b, b'\n' | b'\r' | b'#')
}

/// The number at `start`, which a reader has accepted before.
pub(crate) fn number_at(bytes: &[u8], start: usize) -> &[u8] {
    let rest = &bytes[start..];
    let length = rest
        .iter()
        .position(|&b| ends_word(b) || matches!(b, b'\\' | b'"' | b'\''))
        .unwrap_or(rest.len());
    &rest[..length]
}

impl Word<'_> {
    /// The word as a message shows it.
    pub(crate) fn shown(&self) -> String {
        const LONGEST: usize = 40;
        let head = &self.text[..self.text.len().min(LONGEST)];
        let dots = if self.text.len() > LONGEST { "…" } else { "" };
        format!("\"{}{dots}\"", head.escape_ascii())
    }

    pub(crate) fn integer(&self) -> Option<i64> {
        std::str::from_utf8(self.text).ok()?.parse().ok()
    }
}

pub(crate) fn not_a_number(words: &Words<'_>, word: Word<'_>) -> Fault {
    words.fault_at(
        word,
        format!(
            "{} is not a number: mend the line, or export the file again",
            word.shown()
        ),
    )
}
