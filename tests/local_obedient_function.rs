//! A function that follows instructions in its event, to test the invoker. It implements the Runtime API over a plain
//! socket, so no runtime library affects the results.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::process::exit;
use std::time::Duration;

fn main() {
    let api = std::env::var("AWS_LAMBDA_RUNTIME_API").unwrap_or_default();
    let mut served = 0;
    loop {
        // If the invoker has ended, the call fails, and this process ends.
        let Some((head, event)) = call(&api, "GET", "invocation/next", "") else { exit(0) };
        let id = header(&head, "lambda-runtime-aws-request-id").unwrap_or_default();
        let deadline = header(&head, "lambda-runtime-deadline-ms").unwrap_or_default();
        served += 1;
        let mut end = "response";
        let mut answer = format!("{{\"served\":{served},\"id\":\"{id}\",\"deadline\":{deadline}}}");
        if event.contains("crash") {
            exit(3);
        } else if event.contains("hang") {
            std::thread::sleep(Duration::from_secs(3600));
        } else if event.contains("fail") {
            end = "error";
            answer = "{\"errorType\":\"Asked\",\"errorMessage\":\"as asked\"}".to_owned();
        } else if event.contains("slow") {
            std::thread::sleep(Duration::from_millis(200));
        }
        if call(&api, "POST", &format!("invocation/{id}/{end}"), &answer).is_none() {
            exit(0);
        }
    }
}

fn call(api: &str, method: &str, path: &str, body: &str) -> Option<(String, String)> {
    let (host, base) = api.strip_prefix("http://")?.split_once('/')?;
    let mut stream = TcpStream::connect(host).ok()?;
    let length = body.len();
    let head = format!(
        "{method} /{base}/2018-06-01/runtime/{path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n"
    );
    write!(stream, "{head}Content-Length: {length}\r\n\r\n{body}").ok()?;
    let mut text = String::new();
    stream.read_to_string(&mut text).ok()?;
    let (head, body) = text.split_once("\r\n\r\n")?;
    Some((head.to_owned(), body.to_owned()))
}

fn header(head: &str, name: &str) -> Option<String> {
    let lines = head.lines().filter_map(|line| line.split_once(": "));
    lines.filter(|(found, _)| found.eq_ignore_ascii_case(name)).map(|(_, value)| value.to_owned()).next()
}
