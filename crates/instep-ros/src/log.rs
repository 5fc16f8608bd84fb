//! What the node tells its user, on the terminal and on `/rosout`. Bounded in rate: whoever sends a thousand broken
//! messages a second shall not fill a disk with our complaints.

use std::time::{Duration, Instant};

use ros2_client::builtin_interfaces::Time;
use ros2_client::dds::{NodeLoggingHandle, RosoutRaw};
use ros2_client::log::LogLevel;

/// Lines in a [`WINDOW`] at most.
const LINES: u32 = 40;
const WINDOW: Duration = Duration::from_secs(1);

/// How much a line matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    /// As it should be.
    Info,
    /// Something to look at.
    Warn,
}

/// Who prints.
pub type Print = Box<dyn Fn(Level, &str) + Send>;

pub(crate) struct Log {
    print: Print,
    rosout: NodeLoggingHandle,
    since: Instant,
    lines: u32,
}

impl Log {
    pub(crate) fn new(print: Print, rosout: NodeLoggingHandle) -> Self {
        Self { print, rosout, since: Instant::now(), lines: 0 }
    }

    pub(crate) fn info(&mut self, line: &str) {
        self.say(Level::Info, line);
    }

    pub(crate) fn warn(&mut self, line: &str) {
        self.say(Level::Warn, line);
    }

    fn say(&mut self, level: Level, line: &str) {
        if self.since.elapsed() > WINDOW {
            let hidden = self.lines.saturating_sub(LINES);
            (self.since, self.lines) = (Instant::now(), 0);
            if hidden > 0 {
                self.tell(Level::Warn, &format!("{hidden} more lines in the last second are not shown"));
            }
        }
        self.lines = self.lines.saturating_add(1);
        if self.lines <= LINES {
            self.tell(level, line);
        }
    }

    fn tell(&self, level: Level, line: &str) {
        (self.print)(level, line);
        let ros = match level {
            Level::Info => LogLevel::Info,
            Level::Warn => LogLevel::Warn,
        };
        self.rosout.rosout_raw(Time::now(), ros, "instep", line, "", "", 0);
    }
}
