//! `--print-config`: a command line as a scene file.

use super::{render_command, table_of};
use clap::{Arg, ArgAction, ArgMatches};
use glam::{DAffine3, DMat4};
use splat_io::scene_file::{Setting, Value};
use std::fmt::Write;
use std::path::Path;

/// The scene file that the options of a command line mean, clouds aside. What is left to the cloud is a comment.
///
/// `settled` gives values to options that have none of their own, by name.
pub fn settings(matches: &ArgMatches, settled: &[(&str, String)]) -> String {
    let command = render_command();
    let mut tables: Vec<(String, Vec<&Arg>)> = Vec::new();
    for arg in command.get_arguments() {
        // A path of the picture is for each run to say.
        let Some(table) = table_of(arg).filter(|_| arg.get_long().is_some()) else { continue };
        match tables.iter_mut().find(|(known, _)| *known == table) {
            Some((_, args)) => args.push(arg),
            None => tables.push((table, vec![arg])),
        }
    }
    let mut text = String::new();
    for (table, args) in tables {
        _ = writeln!(text, "[{table}]");
        for arg in args {
            text.push_str(&setting(arg, matches, settled));
        }
        text.push('\n');
    }
    text
}

/// A line for an option: what it is, or that it is left open.
fn setting(arg: &Arg, matches: &ArgMatches, settled: &[(&str, String)]) -> String {
    let name = arg.get_long().unwrap_or_default();
    let is_flag = matches!(arg.get_action(), ArgAction::SetTrue);
    let id = arg.get_id().as_str();
    if is_flag {
        return format!("{name} = {}\n", matches.get_flag(id));
    }
    let raw = match matches.get_raw(id).map(|mut values| values.next()) {
        // It stands alone.
        Some(None) => return format!("{name} = true\n"),
        Some(Some(value)) => Some(value.to_string_lossy().into_owned()),
        None => None,
    };
    let known = settled.iter().find(|(known, _)| *known == name).map(|(_, value)| value.clone());
    match raw.or(known) {
        Some(value) => format!("{name} = {}\n", literal(&value)),
        None => format!("# {name}: {}\n", arg.get_help().map(ToString::to_string).unwrap_or_default()),
    }
}

/// A cloud of a scene file.
pub fn cloud(path: &Path, to_world: &DAffine3, settings: &[Setting]) -> String {
    let mut text = format!("[[cloud]]\npath = {}\n", literal_text(&path.to_string_lossy()));
    if *to_world != DAffine3::IDENTITY {
        let rows = DMat4::from(*to_world).transpose().to_cols_array_2d();
        let rows = rows.map(|row| format!("    [{}],\n", row.map(|value| format!("{value:?}")).join(", ")));
        _ = writeln!(text, "matrix = [\n{}]", rows.concat());
    }
    for Setting { name, value, .. } in settings {
        let value = match value {
            Value::Flag(flag) => flag.to_string(),
            Value::Text(text) => literal(text),
        };
        _ = writeln!(text, "{name} = {value}");
    }
    text.push('\n');
    text
}

/// A value as TOML has it: numbers bare, all else as text.
fn literal(value: &str) -> String {
    let digits = value.strip_prefix('-').unwrap_or(value);
    let is_integer =
        digits == "0" || (digits.parse::<u64>().is_ok() && digits.starts_with(|c| ('1'..='9').contains(&c)));
    let is_float = match digits.split_once('.') {
        Some((whole, part)) => {
            (whole == "0" || (whole.parse::<u64>().is_ok() && !whole.starts_with(['0', '+'])))
                && !part.is_empty()
                && part.bytes().all(|byte| byte.is_ascii_digit())
        }
        None => false,
    };
    if is_integer || is_float { value.to_owned() } else { literal_text(value) }
}

/// A text in quotes.
fn literal_text(text: &str) -> String {
    let mut quoted = String::from("\"");
    for character in text.chars() {
        match character {
            '"' | '\\' => quoted.extend(['\\', character]),
            c if c.is_control() => _ = write!(quoted, "\\u{:04X}", c as u32),
            c => quoted.push(c),
        }
    }
    quoted + "\""
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_io::scene_file::parse_scene;

    #[test]
    fn values_come_back() {
        for value in
            ["16", "0", "-3", "0.5", "-12.25", "007", "1e5", "inf", "a\"b\\c", "30,20", "", "1.", ".5", "+1"]
        {
            let text = format!("[film]\nx = {}\n", literal(value));
            let scene = parse_scene(&text, Path::new("s.toml")).unwrap();
            assert_eq!(scene.sections[0].settings[0].value.to_string(), value, "{text}");
        }
    }

    #[test]
    fn places_come_back() {
        let to_world =
            DAffine3::from_cols_array(&[0.1, 0.2, 0.3, 1e-7, 5.0, 6e20, -7.5, 8.0, 9.0, 1e6, 11.0, 12.0]);
        let text = cloud(Path::new("a b/c\\d.ply"), &to_world, &[]);
        let scene = parse_scene(&text, Path::new("s.toml")).unwrap();
        assert_eq!(scene.clouds[0].path, Path::new("a b/c\\d.ply"));
        assert_eq!(scene.clouds[0].to_world, to_world);
    }
}
