//! A display for tests of windows.
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

/// A virtual X server, ended when dropped.
pub struct Display {
    server: Child,
    /// What names it in the environment variable DISPLAY.
    pub name: String,
}

impl Display {
    /// None, and a word on why, where there is no Xvfb.
    pub fn open() -> Option<Self> {
        let server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1600x1000x24", "-nolisten", "tcp"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let mut server = match server {
            Ok(server) => server,
            Err(cause) => {
                println!("skipped: Xvfb cannot be run ({cause}); ci/setup installs it");
                return None;
            }
        };
        let mut number = String::new();
        BufReader::new(server.stdout.take().expect("piped")).read_line(&mut number).expect("Xvfb names its display");
        assert!(!number.trim().is_empty(), "Xvfb found no display");
        Some(Self { server, name: format!(":{}", number.trim()) })
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}
