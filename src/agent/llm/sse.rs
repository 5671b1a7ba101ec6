//! Incremental parser of server-sent events.

/// Parser that reads events from bytes as they arrive.
#[derive(Default)]
pub(crate) struct Events {
    line: Vec<u8>,
    data: String,
}

impl Events {
    /// Returns the data of the events that these bytes complete.
    pub(crate) fn feed(&mut self, bytes: &[u8]) -> Vec<String> {
        let mut complete = Vec::new();
        for byte in bytes {
            if *byte == b'\n' {
                self.end_of_line(&mut complete);
            } else {
                self.line.push(*byte);
            }
        }
        complete
    }

    /// Returns the data of a last event without an empty line after it.
    pub(crate) fn end(&mut self) -> Option<String> {
        let mut complete = Vec::new();
        self.end_of_line(&mut complete);
        complete.pop().or_else(|| Some(std::mem::take(&mut self.data))).filter(|d| !d.is_empty())
    }

    fn end_of_line(&mut self, complete: &mut Vec<String>) {
        let line = String::from_utf8_lossy(&std::mem::take(&mut self.line)).into_owned();
        let line = line.strip_suffix('\r').unwrap_or(&line);
        if line.is_empty() {
            if !self.data.is_empty() {
                complete.push(std::mem::take(&mut self.data));
            }
        } else if let Some(data) = line.strip_prefix("data:") {
            if !self.data.is_empty() {
                self.data.push('\n');
            }
            self.data.push_str(data.strip_prefix(' ').unwrap_or(data));
        }
        // Comments and the other fields of events are ignored.
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_come_out_whole_however_they_are_cut() {
        let text = ": hello\r\ndata: {\"a\":\r\ndata: 1}\r\n\r\nevent: x\ndata:é\n\ndata: [DONE]";
        for size in [1, 2, 3, 7, 100] {
            let mut events = Events::default();
            let mut all: Vec<String> = text.as_bytes().chunks(size).flat_map(|c| events.feed(c)).collect();
            all.extend(events.end());
            assert_eq!(all, ["{\"a\":\n1}", "é", "[DONE]"], "{size}");
        }
        assert_eq!(Events::default().end(), None);
    }
}
