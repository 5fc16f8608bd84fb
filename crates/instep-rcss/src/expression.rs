//! S-expressions as the server writes them: bytes between brackets and spaces, without quotes.
//!
//! A message is read once, from left to right, into a flat list of nodes; nothing is copied. Depth and number of nodes are
//! bounded: what a hostile packet can cost is known.

/// Deepest nesting that is read.
const DEEPEST: usize = 32;
/// Most nodes of one message.
const MOST: usize = 100_000;

/// Why a message is none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Malformed {
    /// A bracket closes nothing, at this byte.
    Closes(usize),
    /// The message ends within brackets.
    Open,
    /// Deeper than anything that the server sends.
    TooDeep,
    /// More nodes than anything that the server sends.
    TooMany,
}

#[derive(Debug, Clone, Copy)]
enum Node {
    /// Bytes from, to.
    Atom(u32, u32),
    /// A list whose nodes end before this index.
    List(u32),
}

/// A parsed message.
#[derive(Debug, Default)]
pub struct Expressions {
    nodes: Vec<Node>,
    open: Vec<usize>,
}

/// A list of a parsed message, or all of it.
#[derive(Debug, Clone, Copy)]
pub struct List<'a> {
    nodes: &'a [Node],
    begin: usize,
    end: usize,
    text: &'a [u8],
}

/// One thing in a list.
#[derive(Debug, Clone, Copy)]
pub enum Item<'a> {
    /// Bytes without brackets and spaces.
    Atom(&'a [u8]),
    /// What is between brackets.
    List(List<'a>),
}

impl Expressions {
    /// Reads `text`; allocates nothing once it has grown.
    ///
    /// # Errors
    /// [`Malformed`] with what was wrong.
    pub fn parse<'a>(&'a mut self, text: &'a [u8]) -> Result<List<'a>, Malformed> {
        self.nodes.clear();
        self.open.clear();
        if text.len() > u32::MAX as usize {
            return Err(Malformed::TooMany);
        }
        let mut at = 0;
        while at < text.len() {
            match text[at] {
                b'(' => {
                    if self.open.len() >= DEEPEST {
                        return Err(Malformed::TooDeep);
                    }
                    self.open.push(self.nodes.len());
                    self.nodes.push(Node::List(0));
                    at += 1;
                }
                b')' => {
                    let Some(list) = self.open.pop() else { return Err(Malformed::Closes(at)) };
                    self.nodes[list] = Node::List(self.nodes.len() as u32);
                    at += 1;
                }
                b' ' | b'\t' | b'\r' | b'\n' => at += 1,
                _ => {
                    let begin = at;
                    while at < text.len() && !matches!(text[at], b'(' | b')' | b' ' | b'\t' | b'\r' | b'\n') {
                        at += 1;
                    }
                    self.nodes.push(Node::Atom(begin as u32, at as u32));
                }
            }
            if self.nodes.len() > MOST {
                return Err(Malformed::TooMany);
            }
        }
        if !self.open.is_empty() {
            return Err(Malformed::Open);
        }
        Ok(List { nodes: &self.nodes, begin: 0, end: self.nodes.len(), text })
    }
}

impl<'a> List<'a> {
    /// What is in it, in order.
    pub fn items(self) -> impl Iterator<Item = Item<'a>> {
        let mut at = self.begin;
        std::iter::from_fn(move || {
            if at >= self.end {
                return None;
            }
            match self.nodes[at] {
                Node::Atom(from, to) => {
                    at += 1;
                    Some(Item::Atom(&self.text[from as usize..to as usize]))
                }
                Node::List(end) => {
                    let list = List { begin: at + 1, end: end as usize, ..self };
                    at = end as usize;
                    Some(Item::List(list))
                }
            }
        })
    }

    /// The lists in it, in order.
    pub fn lists(self) -> impl Iterator<Item = List<'a>> {
        self.items().filter_map(|item| if let Item::List(list) = item { Some(list) } else { None })
    }

    /// Its first item, where that is an atom: what it is about.
    #[must_use]
    pub fn head(self) -> &'a [u8] {
        match self.items().next() {
            Some(Item::Atom(atom)) => atom,
            _ => b"",
        }
    }

    /// The atom at `index`.
    #[must_use]
    pub fn atom(self, index: usize) -> Option<&'a [u8]> {
        match self.items().nth(index)? {
            Item::Atom(atom) => Some(atom),
            Item::List(_) => None,
        }
    }

    /// The finite number at `index`.
    #[must_use]
    pub fn number(self, index: usize) -> Option<f64> {
        let number: f64 = std::str::from_utf8(self.atom(index)?).ok()?.parse().ok()?;
        number.is_finite().then_some(number)
    }

    /// The first list in it that is about `head`.
    #[must_use]
    pub fn about(self, head: &[u8]) -> Option<List<'a>> {
        self.lists().find(|list| list.head() == head)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Writes a list back.
    fn write(list: List, out: &mut Vec<u8>) {
        for (i, item) in list.items().enumerate() {
            if i > 0 {
                out.push(b' ');
            }
            match item {
                Item::Atom(atom) => out.extend_from_slice(atom),
                Item::List(list) => {
                    out.push(b'(');
                    write(list, out);
                    out.push(b')');
                }
            }
        }
    }

    #[test]
    fn a_message_of_the_server_is_read() {
        let text = b"(time (now 3.02))(GYR (n torso_gyro) (rt 0.25 -1.5 nan))(See (B (pol 4.5 -3.25 -10.0)))";
        let mut expressions = Expressions::default();
        let list = expressions.parse(text).unwrap();
        assert_eq!(list.about(b"time").unwrap().about(b"now").unwrap().number(1), Some(3.02));
        let rate = list.about(b"GYR").unwrap().about(b"rt").unwrap();
        assert_eq!((rate.number(1), rate.number(2), rate.number(3)), (Some(0.25), Some(-1.5), None));
        let ball = list.about(b"See").unwrap().lists().next().unwrap();
        assert_eq!(ball.head(), b"B");
    }

    #[test]
    fn what_is_no_message_is_refused() {
        let mut expressions = Expressions::default();
        assert_eq!(expressions.parse(b"(a b))").unwrap_err(), Malformed::Closes(5));
        assert_eq!(expressions.parse(b"(a (b)").unwrap_err(), Malformed::Open);
        assert_eq!(expressions.parse(&[b'('; 100]).unwrap_err(), Malformed::TooDeep);
        assert_eq!(expressions.parse(&b"a ".repeat(MOST + 1)).unwrap_err(), Malformed::TooMany);
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..3000)) {
            let mut expressions = Expressions::default();
            if let Ok(list) = expressions.parse(&bytes) {
                let mut out = Vec::new();
                write(list, &mut out);
            }
        }

        #[test]
        fn brackets_and_letters_survive_being_written_and_read(text in "[ab() ]{0,200}") {
            let (mut first, mut second) = (Expressions::default(), Expressions::default());
            if let Ok(list) = first.parse(text.as_bytes()) {
                let (mut out, mut again) = (Vec::new(), Vec::new());
                write(list, &mut out);
                write(second.parse(&out).unwrap(), &mut again);
                prop_assert_eq!(out, again);
            }
        }
    }
}
