//! Finds cyclic dependencies between the modules of a crate.
//!
//! Two modules that use each other are one module in two files: neither can be read, tested or changed alone. A module
//! uses another one if it names it by a path, in an import or elsewhere in its code. Re-exports are resolved: the
//! module that defines the item counts as used. Tests do not count.
//!
//! Parents and children: a declaration or a re-export of a child does not count as a use, but a call does. A child may
//! use its parents' types and constants (names that begin with a capital), because these are its context. A use of a
//! parent's function counts like any other.
//!
//! The search knows tokens and no types. Uses without a name (a method of another module's type) are not found.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::{Path, PathBuf};

use proc_macro2::{Delimiter, TokenStream, TokenTree};

/// The modules of a crate according to its files, by their paths from the crate's root.
type Modules = BTreeMap<Vec<String>, Module>;

/// The contents of a module, from its tokens.
#[derive(Debug, Default)]
struct Module {
    children: BTreeSet<String>,
    imports: Vec<Import>,
    /// The paths in its code, and all single names.
    mentions: BTreeSet<Vec<String>>,
}

/// A name that a `use` imports; `*` for a glob.
#[derive(Debug)]
struct Import {
    name: String,
    path: Vec<String>,
    /// Whether the import is a re-export.
    exported: bool,
}

/// A module, and for each module that it uses a path by which it names it.
type Uses = BTreeMap<Vec<String>, BTreeMap<Vec<String>, String>>;

/// Returns the modules that each module of the crate with the root file `root` uses. `read` returns the text of a
/// file, if it exists.
fn uses(root: &Path, read: &dyn Fn(&Path) -> Option<String>) -> Uses {
    let mut modules = Modules::new();
    let text = read(root).unwrap_or_else(|| panic!("no file {}", root.display()));
    let folder = root.parent().expect("a file is in a folder");
    File { path: root, folder, read }.load(&text, &[], &mut modules);
    modules.keys().map(|path| (path.clone(), used_by(path, &modules))).collect()
}

/// Returns the uses among the children of `parent` that lead from one of `rooms` to a later one, and the children that
/// `rooms` lacks. `rooms` is in the order of the data flow: a room uses only those before it.
pub(crate) fn upward(
    root: &Path,
    read: &dyn Fn(&Path) -> Option<String>,
    parent: &str,
    rooms: &[&str],
) -> Vec<String> {
    let uses = uses(root, read);
    let room = |module: &[String]| match module {
        [first, room, ..] if first == parent => Some(room.clone()),
        _ => None,
    };
    let floor = |name: &str| rooms.iter().position(|room| *room == name);
    let mut found: Vec<String> =
        uses.keys().filter_map(|module| room(module)).filter(|name| floor(name).is_none()).collect();
    found.dedup();
    for (module, used) in &uses {
        for (place, path) in used {
            let floors =
                (room(module).and_then(|name| floor(&name)), room(place).and_then(|name| floor(&name)));
            if let (Some(from), Some(to)) = floors
                && from < to
            {
                found.push(format!("{} -> {} (`{path}`)", module.join("::"), place.join("::")));
            }
        }
    }
    found
}

/// Returns the cycles among the modules of the crate with the root file `root`, each in the form `a -> b
/// (crate::b::Thing) -> a (crate::a)`. `read` returns the text of a file, if it exists.
pub(crate) fn circles(root: &Path, read: &dyn Fn(&Path) -> Option<String>) -> Vec<String> {
    let uses = uses(root, read);
    let mut found = Vec::new();
    let mut seen = BTreeSet::new();
    for start in uses.keys().filter(|path| !path.is_empty()).chain(uses.keys().filter(|path| path.is_empty()))
    {
        if !seen.contains(start)
            && let Some(circle) = way_back(start, &uses)
        {
            found.push(tell(&circle, &uses));
            seen.extend(circle);
        }
    }
    found
}

/// A file with a module, and the folder of its children.
struct File<'a> {
    path: &'a Path,
    folder: &'a Path,
    read: &'a dyn Fn(&Path) -> Option<String>,
}

impl File<'_> {
    fn load(&self, text: &str, module: &[String], modules: &mut Modules) {
        let tokens: TokenStream =
            text.parse().unwrap_or_else(|error| panic!("{}: {error}", self.path.display()));
        modules.insert(module.to_vec(), Module::default());
        self.scan(tokens, module, modules);
    }

    /// Adds the tokens of a module, or of a part of it.
    fn scan(&self, tokens: TokenStream, module: &[String], modules: &mut Modules) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let mut at = 0;
        while at < tokens.len() {
            match &tokens[at] {
                TokenTree::Punct(_) if is_test_attribute(&tokens[at..]) => at = after_item(&tokens, at + 2),
                TokenTree::Ident(word) if *word == "use" && !is_punct(tokens.get(at + 1), '<') => {
                    let end =
                        (at..tokens.len()).find(|&i| is_punct(tokens.get(i), ';')).unwrap_or(tokens.len());
                    let exported = is_exported(&tokens[..at]);
                    let imports = &mut entry(modules, module).imports;
                    import(&tokens[at + 1..end], &[], exported, imports);
                    at = end;
                }
                TokenTree::Ident(word) if *word == "mod" && tokens.len() > at + 2 => {
                    at += 1;
                    let name = tokens[at].to_string();
                    let child = [module, std::slice::from_ref(&name)].concat();
                    match &tokens[at + 1] {
                        TokenTree::Punct(_) => self.load_child(&name, &child, modules),
                        TokenTree::Group(body) => {
                            modules.insert(child.clone(), Module::default());
                            self.scan(body.stream(), &child, modules);
                        }
                        other => panic!("{}: `mod {name} {other}`", self.path.display()),
                    }
                    entry(modules, module).children.insert(name);
                    at += 1;
                }
                TokenTree::Ident(_) => {
                    let (path, end) = path_at(&tokens, at);
                    if !is_part(&tokens[..at]) {
                        entry(modules, module).mentions.insert(path);
                    }
                    at = end - 1;
                }
                // The path in `pub(in crate::a)` is a visibility.
                TokenTree::Group(_) if is_exported(&tokens[..=at]) => {}
                TokenTree::Group(group) => self.scan(group.stream(), module, modules),
                TokenTree::Punct(_) | TokenTree::Literal(_) => {}
            }
            at += 1;
        }
    }

    fn load_child(&self, name: &str, child: &[String], modules: &mut Modules) {
        let folder = self.folder.join(name);
        let files: [PathBuf; 2] = [folder.with_extension("rs"), folder.join("mod.rs")];
        let found = files.iter().find_map(|path| Some((path, (self.read)(path)?)));
        let (path, text) =
            found.unwrap_or_else(|| panic!("no file {} or {}", files[0].display(), files[1].display()));
        File { path, folder: &folder, read: self.read }.load(&text, child, modules);
    }
}

fn entry<'a>(modules: &'a mut Modules, module: &[String]) -> &'a mut Module {
    modules.get_mut(module).expect("a module is entered before it is scanned")
}

fn is_punct(token: Option<&TokenTree>, sign: char) -> bool {
    matches!(token, Some(TokenTree::Punct(punct)) if punct.as_char() == sign)
}

/// Returns whether the tokens are `#[cfg(test)]`.
fn is_test_attribute(tokens: &[TokenTree]) -> bool {
    let group = matches!(tokens.get(1), Some(TokenTree::Group(g)) if g.delimiter() == Delimiter::Bracket);
    is_punct(tokens.first(), '#') && group && tokens[1].to_string().replace(' ', "") == "[cfg(test)]"
}

/// Returns the position after the last token of the item that starts at `at`.
fn after_item(tokens: &[TokenTree], at: usize) -> usize {
    let is_use = |token: &TokenTree| matches!(token, TokenTree::Ident(word) if *word == "use");
    let ends = |token: &TokenTree, with_braces: bool| match token {
        TokenTree::Punct(punct) => punct.as_char() == ';',
        TokenTree::Group(group) => with_braces && group.delimiter() == Delimiter::Brace,
        TokenTree::Ident(_) | TokenTree::Literal(_) => false,
    };
    let mut with_braces = true;
    for (i, token) in tokens.iter().enumerate().skip(at) {
        with_braces &= !is_use(token);
        if ends(token, with_braces) {
            return i;
        }
    }
    tokens.len()
}

/// Returns whether the next token follows `pub`, `pub(crate)` or the like.
fn is_exported(before: &[TokenTree]) -> bool {
    let is_pub = |token: &TokenTree| matches!(token, TokenTree::Ident(word) if *word == "pub");
    match before {
        [.., last] if is_pub(last) => true,
        [.., before_last, TokenTree::Group(group)] => {
            group.delimiter() == Delimiter::Parenthesis && is_pub(before_last)
        }
        _ => false,
    }
}

/// Returns whether the next token is a part of a longer expression, after a dot or `::`.
fn is_part(before: &[TokenTree]) -> bool {
    match before {
        [.., last] if is_punct(Some(last), '.') => true,
        [.., before_last, last] => is_punct(Some(before_last), ':') && is_punct(Some(last), ':'),
        _ => false,
    }
}

/// Returns the path `a::b::c` that starts at `at`, and its end.
fn path_at(tokens: &[TokenTree], at: usize) -> (Vec<String>, usize) {
    let mut path = vec![tokens[at].to_string()];
    let mut end = at + 1;
    while is_punct(tokens.get(end), ':')
        && is_punct(tokens.get(end + 1), ':')
        && let Some(TokenTree::Ident(word)) = tokens.get(end + 2)
    {
        path.push(word.to_string());
        end += 3;
    }
    (path, end)
}

/// Collects the names that a `use` tree imports.
fn import(tokens: &[TokenTree], before: &[String], exported: bool, imports: &mut Vec<Import>) {
    for tree in tokens.split(|token| is_punct(Some(token), ',')).filter(|tree| !tree.is_empty()) {
        let mut path = before.to_vec();
        let mut name = None;
        let mut is_alias = false;
        let mut is_branch = false;
        for token in tree {
            match token {
                TokenTree::Ident(word) if *word == "as" => is_alias = true,
                TokenTree::Ident(word) if is_alias => name = Some(word.to_string()),
                TokenTree::Ident(word) if *word == "self" && !path.is_empty() => {}
                TokenTree::Ident(word) => path.push(word.to_string()),
                TokenTree::Group(branches) => {
                    is_branch = true;
                    let branches: Vec<_> = branches.stream().into_iter().collect();
                    import(&branches, &path, exported, imports);
                }
                TokenTree::Punct(sign) if sign.as_char() == '*' => name = Some("*".to_owned()),
                TokenTree::Punct(_) | TokenTree::Literal(_) => {}
            }
        }
        if !is_branch {
            let name = name.or_else(|| path.last().cloned()).unwrap_or_default();
            assert!(!(exported && name == "*"), "re-export by name, not all of `{}`", path.join("::"));
            imports.push(Import { name, path, exported });
        }
    }
}

/// The target of a path: a module, and the first name in it that is no module.
type Place = (Vec<String>, Option<String>);

/// Resolves `path` in `module`. Returns `None` for an item of another crate, and for tokens that are no path.
fn resolved(module: &[String], path: &[String], modules: &Modules, depth: usize) -> Option<Place> {
    // Chains of imports are finite: a cycle of them would not compile.
    if depth > 20 {
        return None;
    }
    let mut place = module.to_vec();
    let mut rest = path;
    match path[0].as_str() {
        "crate" => {
            place.clear();
            rest = &rest[1..];
        }
        "self" => rest = &rest[1..],
        "super" => {
            while rest.first().is_some_and(|word| word == "super") {
                place.pop();
                rest = &rest[1..];
            }
        }
        first if path.len() > 1 && modules[module].children.contains(first) => {}
        first => {
            let import = modules[module].imports.iter().find(|import| import.name == first)?;
            if import.path == path {
                return None;
            }
            let path = [&import.path[..], &rest[1..]].concat();
            return resolved(module, &path, modules, depth + 1);
        }
    }
    while let Some((name, behind)) = rest.split_first() {
        let here = &modules[&place];
        if here.children.contains(name) {
            place.push(name.clone());
            rest = behind;
        } else if let Some(import) = here.imports.iter().find(|import| import.name == *name) {
            let path = [&import.path[..], behind].concat();
            return resolved(&place, &path, modules, depth + 1);
        } else {
            return Some((place, Some(name.clone())));
        }
    }
    Some((place, None))
}

/// Returns the modules that a module uses, each with a path by which it names it.
fn used_by(module: &[String], modules: &Modules) -> BTreeMap<Vec<String>, String> {
    let this = &modules[module];
    let mut used = BTreeMap::new();
    let imported = this.imports.iter().filter(|import| !import.exported).map(|import| &import.path);
    for path in imported.chain(&this.mentions) {
        let Some((place, item)) = resolved(module, path, modules, 0) else { continue };
        let is_type = item.is_some_and(|item| item.starts_with(char::is_uppercase));
        if place != module && !(module.starts_with(&place) && is_type) {
            used.entry(place).or_insert_with(|| path.join("::"));
        }
    }
    used
}

/// Returns a shortest cycle of uses through a module.
fn way_back(start: &Vec<String>, uses: &Uses) -> Option<Vec<Vec<String>>> {
    let mut from: BTreeMap<&Vec<String>, &Vec<String>> = BTreeMap::new();
    let mut open = VecDeque::from([start]);
    while let Some(module) = open.pop_front() {
        for next in uses[module].keys() {
            if next == start {
                let mut way = vec![module.clone()];
                while let Some(before) = way.last().filter(|last| *last != start).map(|last| from[last]) {
                    way.push(before.clone());
                }
                way.reverse();
                return Some(way);
            }
            if !from.contains_key(next) {
                from.insert(next, module);
                open.push_back(next);
            }
        }
    }
    None
}

fn tell(circle: &[Vec<String>], uses: &Uses) -> String {
    let name = |module: &[String]| if module.is_empty() { "crate".to_owned() } else { module.join("::") };
    let mut path = name(&circle[0]);
    for (i, module) in circle.iter().enumerate() {
        let next = &circle[(i + 1) % circle.len()];
        path += &format!(" -> {} (`{}`)", name(next), uses[module][next]);
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares the cycles of a crate that consists of these files with the expected ones.
    fn check(files: &[(&str, &str)], expect: &[&str]) {
        let read = |path: &Path| {
            files.iter().find(|(name, _)| Path::new(name) == path).map(|(_, text)| (*text).to_owned())
        };
        assert_eq!(circles(Path::new("lib.rs"), &read), expect, "{files:#?}");
    }

    #[test]
    fn siblings_that_import_each_other() {
        let files = [
            ("lib.rs", "mod a; mod b;"),
            ("a.rs", "use crate::b::B; struct A;"),
            ("b.rs", "use super::a::A; struct B;"),
        ];
        check(&files, &["a -> b (`crate::b::B`) -> a (`super::a::A`)"]);
        let files = [("lib.rs", "mod a; mod b;"), ("a.rs", "use crate::b::B;"), ("b.rs", "struct B;")];
        check(&files, &[]);
    }

    #[test]
    fn a_circle_of_three_in_branches_aliases_and_code() {
        let files = [
            ("lib.rs", "pub mod a; mod b; mod c;"),
            ("a/mod.rs", "use crate::{b::{self as other, X}, c::Y as Z}; fn f() { other::g(); }"),
            ("b.rs", "fn g() -> u8 { crate::c::h(1, [2, { 3 }]) }"),
            ("c.rs", "fn h() { if true { let a = crate::a::f(); } }"),
        ];
        let expect = [
            "a -> c (`crate::c::Y`) -> a (`crate::a::f`)",
            "b -> c (`crate::c::h`) -> a (`crate::a::f`) -> b (`crate::b`)",
        ];
        check(&files, &expect);
    }

    #[test]
    fn a_circle_through_re_exports() {
        let files = [
            ("lib.rs", "mod a; mod b; pub use a::A; pub(crate) use b::B as Renamed;"),
            ("a.rs", "struct A; fn f(_: crate::Renamed) {}"),
            ("b.rs", "use crate::A; struct B;"),
        ];
        check(&files, &["a -> b (`crate::Renamed`) -> a (`crate::A`)"]);
    }

    #[test]
    fn a_child_may_use_its_parents_types_but_not_its_functions() {
        let parent = "mod child; pub use child::Thing; struct Settings; const MOST: u8 = 1; fn helper() {} \
                      fn run() { child::work(); }";
        let with = |child: &'static str| {
            [("lib.rs", "mod parent;"), ("parent.rs", parent), ("parent/child.rs", child)]
        };
        check(&with("use super::{MOST, Settings}; fn work() { super::Settings::new(); }"), &[]);
        let circle = "parent -> parent::child (`child::work`) -> parent (`super::helper`)";
        check(&with("fn work() { super::helper() }"), &[circle]);
    }

    #[test]
    fn to_declare_and_to_re_export_a_child_is_not_to_use_it() {
        let child = ("parent/child.rs", "struct Thing; fn work() { super::helper(); }");
        let declared = "mod child; pub use child::Thing; fn helper() {}";
        check(&[("lib.rs", "mod parent;"), ("parent.rs", declared), child], &[]);
        let used = "mod child; pub use child::Thing; fn helper() { let thing: Thing; }";
        let circle = "parent -> parent::child (`Thing`) -> parent (`super::helper`)";
        check(&[("lib.rs", "mod parent;"), ("parent.rs", used), child], &[circle]);
    }

    #[test]
    fn tests_comments_and_texts_do_not_count() {
        let a = "//! See [crate::b].\n/* use crate::b; */ const TEXT: &str = \"crate::b::B\"; \
                 #[cfg(test)] use crate::b::{B}; #[cfg(test)] #[allow(x)] mod tests { use crate::b::B; } struct A;";
        check(&[("lib.rs", "mod a; mod b;"), ("a.rs", a), ("b.rs", "use crate::a::A; struct B;")], &[]);
        let a = "#[cfg(any(test, feature = \"x\"))] mod real { use crate::b::B; } #[cfg(test)] fn f() {} struct A;";
        let files = [("lib.rs", "mod a; mod b;"), ("a.rs", a), ("b.rs", "use crate::a::real; struct B;")];
        check(&files, &["a::real -> b (`crate::b::B`) -> a::real (`crate::a::real`)"]);
    }

    #[test]
    #[should_panic(expected = "no file a.rs or a/mod.rs")]
    fn a_module_that_is_not_found_is_an_error() {
        check(&[("lib.rs", "mod a;")], &[]);
    }

    #[test]
    fn a_room_uses_only_those_before_it() {
        let files = [
            ("lib.rs", "mod house;"),
            ("house/mod.rs", "mod cellar; mod hall; mod attic; fn f() { attic::g(); }"),
            ("house/cellar.rs", "use crate::house::hall::Lamp; struct Wine;"),
            ("house/hall.rs", "use super::cellar::Wine; struct Lamp;"),
            ("house/attic.rs", "fn g() { super::hall::Lamp; }"),
        ];
        let read = |path: &Path| {
            files.iter().find(|(name, _)| Path::new(name) == path).map(|(_, text)| (*text).to_owned())
        };
        assert_eq!(
            upward(Path::new("lib.rs"), &read, "house", &["cellar", "hall"]),
            ["attic", "house::cellar -> house::hall (`crate::house::hall::Lamp`)"]
        );
    }
}
