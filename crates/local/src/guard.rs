//! A child process that ends with this process, whatever the cause.
//!
//! The program runs under a small POSIX shell that holds the read end of a pipe; this process holds the write end. If
//! this process closes it or ends, also by SIGKILL, the kernel closes it. The shell then reads the end of file and
//! stops the program by its process id, with SIGKILL if the program does not end within five seconds. This needs no
//! signal handler, no `unsafe`, and no search by name. The shell has its own process group, so that this process
//! handles a Ctrl-C in the terminal and stops the parts in order.
//! The shell holds a lock file until the program has ended, so that no successor starts on the same data before.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::{Mutex, PoisonError};

use crate::error::{Error, Result};

const SCRIPT: &str = r#"
log=$1; shift
exec 3<&0 4>&2
"$@" 3<&- 4>&- </dev/null >>"$log" 2>&1 &
pid=$!
echo "$pid"
exec >/dev/null 2>&1
( exec 4>&-; read -r _ <&3; kill "$pid"; sleep 5; kill -9 "$pid" ) &
keeper=$!
exec 3<&-
wait "$pid"
status=$?
kill "$keeper"
exit "$status"
"#;

/// A running program. Dropping it stops the program and waits until it has ended.
#[derive(Debug)]
pub(crate) struct Guarded {
    shell: Mutex<Child>,
    lifeline: Option<ChildStdin>,
    pid: u32,
}

impl Guarded {
    /// Starts `program` and appends its output to `log`. `lock`, if given, stays locked until the program has ended.
    ///
    /// # Errors
    /// Fails with [`Error::Spawn`] if the shell cannot be started. If the program is missing,
    /// [`Self::exited`] returns a status.
    pub(crate) fn spawn(
        program: &Path,
        args: &[String],
        env: impl IntoIterator<Item = (String, String)>,
        log: &Path,
        lock: &File,
    ) -> Result<Self> {
        let failed = |source| Error::Spawn { program: program.to_owned(), source };
        let mut shell = Command::new("sh")
            .args(["-c", SCRIPT, "sh"])
            .arg(log)
            .arg(program)
            .args(args)
            .envs(env)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(lock.try_clone().map_err(failed)?)
            .process_group(0)
            .spawn()
            .map_err(failed)?;
        let lifeline = shell.stdin.take();
        let mut line = String::new();
        if let Some(out) = shell.stdout.take() {
            BufReader::new(out).read_line(&mut line).map_err(failed)?;
        }
        let Ok(pid) = line.trim().parse() else {
            return Err(failed(std::io::Error::other("the shell named no process")));
        };
        Ok(Self { shell: Mutex::new(shell), lifeline, pid })
    }

    /// The program's process id.
    pub(crate) fn pid(&self) -> u32 {
        self.pid
    }

    /// Returns the program's exit status if it has ended.
    pub(crate) fn exited(&self) -> Option<ExitStatus> {
        self.shell.lock().unwrap_or_else(PoisonError::into_inner).try_wait().ok().flatten()
    }
}

impl Drop for Guarded {
    fn drop(&mut self) {
        drop(self.lifeline.take());
        let _ = self.shell.get_mut().unwrap_or_else(PoisonError::into_inner).wait();
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use super::*;

    fn alive(pid: u32) -> bool {
        Command::new("kill").args(["-0", &pid.to_string()]).stderr(Stdio::null()).status().unwrap().success()
    }

    /// Starts a shell that writes its process id into a file and then runs the script.
    fn sleeper(script: &str) -> (Guarded, u32, tempfile::TempDir) {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("pid");
        let args =
            ["-c".to_owned(), format!("echo $$ >'{0}.new'; mv '{0}.new' '{0}'; {script}", file.display())];
        let lock = File::create(folder.path().join("lock")).unwrap();
        lock.lock().unwrap();
        let guarded = Guarded::spawn(Path::new("sh"), &args, [], &folder.path().join("log"), &lock).unwrap();
        let start = Instant::now();
        let pid = loop {
            if let Ok(text) = std::fs::read_to_string(&file) {
                break text.trim().parse().unwrap();
            }
            assert!(start.elapsed() < Duration::from_secs(10));
            std::thread::sleep(Duration::from_millis(5));
        };
        (guarded, pid, folder)
    }

    #[test]
    fn a_dropped_program_is_gone() {
        let (guarded, pid, _folder) = sleeper("while :; do sleep 0.05; done");
        assert!(alive(pid));
        drop(guarded);
        assert!(!alive(pid));
    }

    #[test]
    fn a_lock_is_held_until_the_program_is_gone() {
        let (guarded, _, folder) = sleeper("while :; do sleep 0.05; done");
        let lock = File::open(folder.path().join("lock")).unwrap();
        assert!(lock.try_lock().is_err());
        drop(guarded);
        lock.try_lock().unwrap();
    }

    #[test]
    fn a_program_that_ends_by_itself_is_seen() {
        let (guarded, _, _folder) = sleeper("exit 7");
        let start = Instant::now();
        let status = loop {
            if let Some(status) = guarded.exited() {
                break status;
            }
            assert!(start.elapsed() < Duration::from_secs(10));
            std::thread::sleep(Duration::from_millis(5));
        };
        assert_eq!(status.code(), Some(7));
    }

    #[test]
    fn a_program_that_ignores_signals_is_killed() {
        let (guarded, pid, _folder) = sleeper("trap '' TERM; while :; do sleep 0.05; done");
        std::thread::sleep(Duration::from_millis(100));
        drop(guarded);
        assert!(!alive(pid));
    }
}
