//! ES modules in one script.
//!
//! Modules cannot import each other in a page from `file://`, and a policy with hashes does not allow
//! `data:` modules. So each module becomes a function that returns what it exports:
//!
//! ```text
//! // b.js                              const $b = (() => {
//! import { a as one } from "./a.js";   const { a: one } = $a;
//! export function b() {}               function b() {}
//!                                      return { b };
//!                                      })();
//! ```
//!
//! Modules are linked in the order given, so that each comes after those it imports. An import or
//! export has one line, and names what it takes; both are tested.

use std::fmt::Write as _;

/// A module: its name without extension, and its text.
pub(crate) type Module = (&'static str, &'static str);

/// Links modules into one script.
pub(crate) fn link(modules: &[Module]) -> String {
    let mut script = String::from("\"use strict\";\n");
    for (name, text) in modules {
        let mut exports: Vec<&str> = Vec::new();
        let _ = writeln!(script, "const ${name} = (() => {{");
        for line in text.lines() {
            if let Some((names, from)) = import(line) {
                let _ = writeln!(script, "const {{{}}} = ${from};", names.replace(" as ", ": "));
            } else if let Some(declaration) = line.strip_prefix("export ") {
                exports.extend(declared(declaration));
                script.push_str(declaration);
                script.push('\n');
            } else {
                script.push_str(line);
                script.push('\n');
            }
        }
        let _ = writeln!(script, "return {{ {} }};\n}})();", exports.join(", "));
    }
    script
}

/// The names and the module of `import { names } from "./module.js";`.
fn import(line: &str) -> Option<(&str, &str)> {
    let (names, from) = line.strip_prefix("import {")?.split_once("} from \"./")?;
    Some((names, from.strip_suffix(".js\";")?))
}

/// The name that a declaration declares.
fn declared(declaration: &str) -> Option<&str> {
    let kinds = ["async function ", "function ", "class ", "const "];
    let rest = kinds.iter().find_map(|kind| declaration.strip_prefix(kind))?;
    rest.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).next()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::page::MODULES;

    #[test]
    fn modules_become_functions() {
        let a = "// A.\nexport const a = 1;\nexport async function wait() {\n  return a;\n}\n";
        let b = "import { a as one, wait } from \"./a.js\";\nexport class B {}\nwait(one);\n";
        let linked = "\"use strict\";\nconst $a = (() => {\n// A.\nconst a = 1;\nasync function wait() {\n  return a;\n}\n\
                      return { a, wait };\n})();\nconst $b = (() => {\nconst { a: one, wait } = $a;\nclass B {}\n\
                      wait(one);\nreturn { B };\n})();\n";
        assert_eq!(link(&[("a", a), ("b", b)]), linked);
    }

    #[test]
    fn imports_and_exports_are_of_the_form_that_is_linked() {
        let mut known: Vec<(&str, Vec<&str>)> = Vec::new();
        for (name, text) in MODULES {
            let mut exports = Vec::new();
            for line in text.lines() {
                if line.starts_with("import ") {
                    let (names, from) = import(line).unwrap_or_else(|| panic!("{name}: {line}"));
                    let (_, exported) =
                        known.iter().find(|(module, _)| *module == from).expect("an earlier module");
                    for wanted in names.split(',').map(|name| name.trim().split(" as ").next().unwrap()) {
                        assert!(exported.contains(&wanted), "{name}: {from} does not export {wanted}");
                    }
                }
                if let Some(declaration) = line.strip_prefix("export ") {
                    exports.push(declared(declaration).unwrap_or_else(|| panic!("{name}: {line}")));
                }
            }
            known.push((name, exports));
        }
        assert!(known.len() > 8);
    }
}
