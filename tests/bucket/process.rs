//! The object store as a separate process, which can be killed, limited and measured.

use std::io::{BufRead, BufReader};
use std::net::SocketAddr;
use std::path::Path;
use std::process::{Child, Command, Stdio};

use rayfold_bucket::Webhook;

pub(crate) struct Process {
    child: Child,
    address: SocketAddr,
}

impl Process {
    /// Starts the process and waits until it replies. `largest_file` is in blocks of 1024 bytes: a write beyond it
    /// fails like on a full disk.
    pub(crate) fn start(data: &Path, webhook: Option<&Webhook>, largest_file: Option<u64>) -> Self {
        let binary = env!("CARGO_BIN_EXE_rayfold-bucket");
        // The limit that the shell sets persists after it, like the ignored signal.
        let limit = largest_file.map_or("unlimited".to_owned(), |blocks| blocks.to_string());
        let script = format!("trap '' XFSZ; ulimit -f {limit}; exec \"$0\" \"$@\"");
        let mut command = Command::new("bash");
        command.args(["-c", &script, binary, "--data"]).arg(data);
        command.env("AWS_ACCESS_KEY_ID", "root").env("AWS_SECRET_ACCESS_KEY", "secret-key");
        if let Some(webhook) = webhook {
            command.args(["--webhook", &webhook.url]).env("RAYFOLD_BUCKET_WEBHOOK_TOKEN", &webhook.token);
        }
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let address = line.trim().strip_prefix("http://").expect("no address: did it start?");
        Self { address: address.parse().unwrap(), child }
    }

    pub(crate) fn address(&self) -> SocketAddr {
        self.address
    }

    /// Kills the process by `kill -9`.
    pub(crate) fn kill(mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    /// Returns its peak memory in bytes.
    pub(crate) fn peak_memory(&self) -> u64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).unwrap();
        let line = status.lines().find(|line| line.starts_with("VmHWM:")).unwrap();
        line.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap() * 1024
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
