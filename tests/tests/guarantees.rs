//! docs/guarantees.md names tests that are there.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// The names of all tests in the Rust files of a folder: functions after an attribute of a test, those in macros included.
fn tests_in(folder: &Path, names: &mut BTreeSet<String>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            tests_in(&path, names);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let text = fs::read_to_string(&path).unwrap();
            let mut is_test = false;
            for line in text.lines().map(str::trim) {
                let function = line.strip_prefix("fn ").and_then(|rest| rest.split_once('('));
                match function {
                    Some((name, _)) if is_test => {
                        names.insert(name.to_owned());
                        is_test = false;
                    }
                    _ if line == "#[test]" => is_test = true,
                    // Other attributes and comments may stand between.
                    _ if line.starts_with('#') || line.starts_with("//") => {}
                    _ => is_test = false,
                }
            }
        }
    }
}

#[test]
fn every_guarantee_has_its_tests() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let page = fs::read_to_string(root.join("docs/guarantees.md")).unwrap();
    let rows = page.lines().filter(|line| line.starts_with("| ") && !line.starts_with("| promise"));
    let mut promises = 0;
    for row in rows {
        let [_, promise, held_by, _] = row.split('|').collect::<Vec<_>>()[..] else {
            panic!("two columns: {row}");
        };
        let mut held = false;
        for part in held_by.split(';') {
            // In quotes: the package, then its tests.
            let mut quoted = part.split('`').skip(1).step_by(2);
            let package = quoted.next().unwrap_or_else(|| panic!("a package for{promise}"));
            let folder = root.join(if package == "splat-tests" { "tests" } else { package });
            let mut names = BTreeSet::new();
            tests_in(&folder, &mut names);
            for name in quoted {
                assert!(names.contains(name), "no test {name} in {package}, for{promise}");
                held = true;
            }
        }
        assert!(held, "nothing holds{promise}");
        promises += 1;
    }
    assert!(promises > 20, "{promises} promises");
}
