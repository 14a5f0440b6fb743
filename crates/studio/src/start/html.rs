//! The text of the start page.

use std::path::{Path, PathBuf};

const HEAD: &str = "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n\
                    <meta name=\"viewport\" content=\"width=device-width\">\n<title>rayfold studio</title>\n\
                    <link rel=\"stylesheet\" href=\"start.css\">\n<link rel=\"icon\" href=\"data:,\">\n\
                    <main>\n<h1>rayfold studio</h1>\n";

/// Returns the page with recent scenes, each with its number, and examples, of which copies are made in `folder`.
pub(super) fn page(recent: &[(usize, PathBuf)], folder: &Path, examples: &[&str]) -> String {
    let mut html = HEAD.to_owned();
    html.push_str("<section>\n<h2>New</h2>\n<div class=\"cards\">\n");
    html.push_str(&card("open", "example.png", "Empty scene", "A floor, a sun and a camera"));
    html.push_str("</div>\n</section>\n");
    if !recent.is_empty() {
        html.push_str("<section>\n<h2>Recent</h2>\n<ul>\n");
        for (number, path) in recent {
            let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
            let (name, path) = (escaped(&name), escaped(&path.to_string_lossy()));
            html.push_str(&format!(
                "<li><a href=\"open?recent={number}\"><b>{name}</b> <span>{path}</span></a></li>\n"
            ));
        }
        html.push_str("</ul>\n</section>\n");
    }
    html.push_str("<section>\n<h2>Examples</h2>\n<div class=\"cards\">\n");
    for name in examples {
        let query = format!("example={name}");
        html.push_str(&card(&format!("open?{query}"), &format!("example.png?{query}"), name, ""));
    }
    let folder = escaped(&folder.to_string_lossy());
    html.push_str(&format!(
        "</div>\n<p>New scenes and copies of examples are made in {folder}.</p>\n</section>\n</main>\n"
    ));
    html
}

fn card(link: &str, picture: &str, name: &str, about: &str) -> String {
    format!(
        "<a class=\"card\" href=\"{link}\"><img src=\"{picture}\" alt=\"\" loading=\"lazy\"><b>{name}</b> <span>{about}</span></a>\n"
    )
}

/// Returns a text as HTML. Characters that are invisible or change the order of others are shown by their numbers.
fn escaped(text: &str) -> String {
    let mut html = String::new();
    for c in text.chars() {
        match c {
            '&' => html.push_str("&amp;"),
            '<' => html.push_str("&lt;"),
            '>' => html.push_str("&gt;"),
            '"' => html.push_str("&quot;"),
            c if c.is_control()
                || matches!(c, '\u{200b}'..='\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}') =>
            {
                html.push_str(&format!("U+{:04X}", u32::from(c)));
            }
            c => html.push(c),
        }
    }
    html
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_text_and_show_what_they_are() {
        let page = page(&[(7, PathBuf::from("/a/<b>\u{202e}&\"c"))], Path::new("/x<y"), &["hello"]);
        assert!(page.contains("<b>&lt;b&gt;U+202E&amp;&quot;c</b>"), "{page}");
        assert!(page.contains("made in /x&lt;y."), "{page}");
    }
}
