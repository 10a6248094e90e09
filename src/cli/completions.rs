//! `threadlight completions`: scripts that teach a shell the command line.
use clap::CommandFactory;

/// Prints a completion script for a shell.
#[derive(clap::Args)]
pub struct Completions {
    /// Which shell.
    shell: clap_complete::Shell,
}

impl Completions {
    pub fn run(self) -> anyhow::Result<()> {
        // Not straight to standard output, as clap_complete panics where it cannot write.
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut super::Arguments::command(), "threadlight", &mut script);
        Ok(super::print(String::from_utf8_lossy(&script))?)
    }
}
