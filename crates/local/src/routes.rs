//! Maps an event to a function by the prefix of its key, by the same file that Terraform reads.
//!
//! ```
//! use rayfold_local::routes::{Function, Routes};
//!
//! let routes = Routes::shared();
//! assert_eq!(routes.function("scripts/a/1.txt", "s3:ObjectCreated:Put"), Some(Function::Render));
//! assert_eq!(routes.function("frames/a/1@x.png", "s3:ObjectCreated:Put"), None);
//! ```

use std::fmt;

use rayfold_pipeline::store::Notification;
use serde::Deserialize;

const SHARED: &str = include_str!("../../../infra/terraform/routes.json");

/// A function of the pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Function {
    /// The function that draws frames.
    Render,
    /// The function that builds GIFs, and sweeps.
    Assemble,
}

impl Function {
    /// Both functions, the render function first.
    pub const ALL: [Self; 2] = [Self::Render, Self::Assemble];

    /// Returns the name of the function's binary.
    pub fn binary(self) -> &'static str {
        match self {
            Self::Render => "rayfold-render",
            Self::Assemble => "rayfold-assemble",
        }
    }
}

impl fmt::Display for Function {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Render => "render",
            Self::Assemble => "assemble",
        })
    }
}

/// A rule by which keys with a prefix invoke a function.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Route {
    /// The prefix of the keys.
    pub prefix: String,
    /// The function that they invoke.
    pub function: Function,
    /// S3's names of the events; a `*` at the end stands for any.
    pub events: Vec<String>,
}

/// The routes of all events.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Routes {
    routes: Vec<Route>,
}

impl Routes {
    /// Returns the routes of `infra/terraform/routes.json`.
    ///
    /// # Panics
    /// Does not panic: the file is compiled in, and a test reads it.
    #[expect(clippy::expect_used, reason = "compiled in and read by a test")]
    pub fn shared() -> Self {
        serde_json::from_str(SHARED).expect("routes.json is well formed")
    }

    /// Returns an iterator over the routes.
    pub fn iter(&self) -> impl Iterator<Item = &Route> {
        self.routes.iter()
    }

    /// Returns the notifications that a store must send to this queue.
    pub fn notifications(&self, queue_arn: &str) -> Vec<Notification> {
        let to_queue = |route: &Route| Notification {
            prefix: route.prefix.clone(),
            events: route.events.clone(),
            queue_arn: queue_arn.to_owned(),
        };
        self.iter().map(to_queue).collect()
    }

    /// Returns the function that an event on a key invokes. The key is decoded. AWS writes event
    /// names without the `s3:`.
    pub fn function(&self, key: &str, event: &str) -> Option<Function> {
        let event = event.strip_prefix("s3:").unwrap_or(event);
        let wakes = |pattern: &String| {
            let pattern = pattern.strip_prefix("s3:").unwrap_or(pattern);
            match pattern.strip_suffix('*') {
                Some(start) => event.starts_with(start),
                None => event == pattern,
            }
        };
        self.iter()
            .find(|route| key.starts_with(&route.prefix) && route.events.iter().any(wakes))
            .map(|route| route.function)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shared_routes_are_read() {
        let routes = Routes::shared();
        assert_eq!(routes.function("scripts/a b/ü+.txt", "ObjectRemoved:Delete"), Some(Function::Render));
        assert_eq!(routes.function("parts/a/x@1/1.json", "s3:ObjectCreated:Put"), Some(Function::Render));
        assert_eq!(routes.function("parts/a/x@1/1.json", "s3:ObjectRemoved:Delete"), None);
        assert_eq!(
            routes.function("assemblies/a/1-2.json", "s3:ObjectCreated:Put"),
            Some(Function::Assemble)
        );
        assert_eq!(routes.function("animations/a.gif", "s3:ObjectCreated:Put"), None);
    }
}
