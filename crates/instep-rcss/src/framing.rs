//! Messages behind their length: four bytes, big endian, then as many bytes.
//!
//! Bytes come in pieces of any size; messages leave whole. A length beyond the bound means that the other end speaks something
//! else, and nothing after it can be trusted.

/// Longest message that is believed, bytes: a full perception of a 22-player game has about 20 000.
pub const LONGEST: usize = 1 << 20;

/// A length that cannot be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TooLong(pub usize);

/// Collects bytes and gives messages.
#[derive(Debug, Default)]
pub struct Inbox {
    bytes: Vec<u8>,
    /// Where the next message begins.
    begin: usize,
}

impl Inbox {
    /// Takes what came over the line.
    pub fn push(&mut self, bytes: &[u8]) {
        if self.begin == self.bytes.len() {
            self.bytes.clear();
            self.begin = 0;
        } else if self.begin > LONGEST {
            self.bytes.drain(..self.begin);
            self.begin = 0;
        }
        self.bytes.extend_from_slice(bytes);
    }

    /// The next whole message, if there is one.
    ///
    /// # Errors
    /// [`TooLong`] for a length beyond [`LONGEST`]: the line is to be closed.
    pub fn take(&mut self) -> Result<Option<&[u8]>, TooLong> {
        let rest = &self.bytes[self.begin..];
        let Some((head, body)) = rest.split_first_chunk::<4>() else { return Ok(None) };
        let length = u32::from_be_bytes(*head) as usize;
        if length > LONGEST {
            return Err(TooLong(length));
        }
        if body.len() < length {
            return Ok(None);
        }
        let begin = self.begin + 4;
        self.begin = begin + length;
        Ok(Some(&self.bytes[begin..begin + length]))
    }

    /// Whether another whole message is there already.
    #[must_use]
    pub fn has_next(&self) -> bool {
        let rest = &self.bytes[self.begin..];
        rest.split_first_chunk::<4>().is_some_and(|(head, body)| body.len() >= u32::from_be_bytes(*head) as usize)
    }
}

/// Puts `message` behind its length into `out`.
pub fn frame(message: &[u8], out: &mut Vec<u8>) {
    out.clear();
    // Our own messages have some thousand bytes.
    out.extend_from_slice(&(u32::try_from(message.len()).unwrap_or(0)).to_be_bytes());
    out.extend_from_slice(message);
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn whatever_the_pieces_the_messages_come_out_whole(
            messages in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..300), 0..20),
            cuts in prop::collection::vec(1_usize..400, 1..40),
        ) {
            let (mut line, mut one) = (Vec::new(), Vec::new());
            for message in &messages {
                frame(message, &mut one);
                line.extend_from_slice(&one);
            }
            let (mut inbox, mut found) = (Inbox::default(), Vec::new());
            let (mut at, mut cut) = (0, cuts.iter().cycle());
            while at < line.len() {
                let end = (at + cut.next().unwrap()).min(line.len());
                inbox.push(&line[at..end]);
                at = end;
                while inbox.has_next() {
                    found.push(inbox.take().unwrap().unwrap().to_vec());
                }
                prop_assert!(inbox.take().unwrap().is_none());
            }
            prop_assert_eq!(found, messages);
        }

        #[test]
        fn any_bytes_are_taken_without_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
            let mut inbox = Inbox::default();
            inbox.push(&bytes);
            while let Ok(Some(_)) = inbox.take() {}
        }
    }

    #[test]
    fn a_length_that_cannot_be_is_refused() {
        let mut inbox = Inbox::default();
        inbox.push(b"HTTP/1.1 400 Bad Request\r\n");
        assert_eq!(inbox.take(), Err(TooLong(0x4854_5450)));
    }
}
