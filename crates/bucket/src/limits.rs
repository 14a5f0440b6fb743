//! The limits that `s3s` enforces. They differ while it receives a browser's form.

use std::sync::Arc;

use s3s::config::{S3Config, S3ConfigProvider};

/// The largest file of a form in bytes, because `s3s` keeps it in memory.
const LARGEST_FORM_FILE: u64 = 256 * 1024 * 1024;

/// The longest time between signing and using a form: a week, as for a URL. The form's policy says when it expires.
const OLDEST_FORM_SECONDS: u32 = 604_800;

tokio::task_local! {
    static IS_FORM: ();
}

/// A provider of the limits, see the module.
pub(crate) struct Limits {
    plain: Arc<S3Config>,
    form: Arc<S3Config>,
}

impl Limits {
    pub(crate) fn new() -> Self {
        let mut form = S3Config::default();
        form.post_object_max_file_size = LARGEST_FORM_FILE;
        form.presigned_url_max_skew_time_secs = OLDEST_FORM_SECONDS;
        Self { plain: Arc::default(), form: Arc::new(form) }
    }
}

impl S3ConfigProvider for Limits {
    fn snapshot(&self) -> Arc<S3Config> {
        let is_form = IS_FORM.try_with(|()| ()).is_ok();
        Arc::clone(if is_form { &self.form } else { &self.plain })
    }
}

/// Runs the answer to a form under the limits of forms.
pub(crate) async fn of_form<F: Future>(answer: F) -> F::Output {
    IS_FORM.scope((), answer).await
}
