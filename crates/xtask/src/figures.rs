//! `cargo xtask figures`: the pictures of docs/stability.md, each by the command that the page shows for it.

use std::path::Path;
use std::process::Command;

use anyhow::{Context as _, Result, ensure};

use crate::{
    package::{self, Order},
    workspace,
};

const PAGE: &str = "docs/stability.md";
/// Exit status of `maglev` where a mode grows.
const GROWS: i32 = 1;

/// Runs every `maglev` command of the page that writes to results/NAME and has a picture docs/stability-NAME.svg.
pub fn draw() -> Result<()> {
    package::package(&Order { also: &[workspace::COMMAND], ..Order::default() })?;
    let root = workspace::root();
    let page = std::fs::read_to_string(root.join(PAGE)).with_context(|| PAGE.to_owned())?;
    for words in commands(&page) {
        let Some(out) = words.iter().position(|it| it == "--out").and_then(|k| words.get(k + 1))
        else {
            continue;
        };
        let name = Path::new(out).file_name().unwrap_or_default().to_string_lossy().into_owned();
        let picture = format!("stability-{name}.svg");
        if !page.contains(&format!("({picture})")) {
            continue;
        }
        eprintln!("{}", words.join(" "));
        let status =
            Command::new(workspace::maglev()).args(&words[1..]).current_dir(&root).status()?;
        ensure!(
            status.success() || status.code() == Some(GROWS),
            "{} ended with {status}",
            words.join(" ")
        );
        let folder = root.join(out);
        let drawn = ["map.svg", "positions.svg"].map(|it| folder.join(it));
        let drawn = drawn.iter().find(|it| it.exists()).context("no picture was written")?;
        std::fs::copy(drawn, root.join("docs").join(&picture))?;
    }
    Ok(())
}

/// The words of all `maglev` commands in the blocks of a page; a backslash continues a line.
fn commands(page: &str) -> Vec<Vec<String>> {
    let blocks = page.split("```").skip(1).step_by(2);
    let lines = blocks.flat_map(|block| {
        let joined = block.replace("\\\n", " ");
        joined.lines().map(|line| line.trim().to_owned()).collect::<Vec<_>>()
    });
    lines.filter(|line| line.starts_with("maglev ")).map(|line| words(&line)).collect()
}

/// Words of a command line, with quotes as a shell has them.
fn words(line: &str) -> Vec<String> {
    let (mut all, mut word, mut quote, mut any) = (Vec::new(), String::new(), None, false);
    for c in line.chars() {
        match (quote, c) {
            (Some(q), c) if c == q => quote = None,
            (None, '\'' | '"') => (quote, any) = (Some(c), true),
            (None, ' ') => {
                if any || !word.is_empty() {
                    all.push(std::mem::take(&mut word));
                }
                any = false;
            }
            _ => word.push(c),
        }
    }
    if any || !word.is_empty() {
        all.push(word);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_commands_of_a_page_are_split_as_by_a_shell() {
        let page = "a\n```sh\nmaglev map x.json --x 'ems_*.g=1:2:3' \\\n    --title \"two words\"\nls\n```\nmaglev no\n";
        let expected = ["maglev", "map", "x.json", "--x", "ems_*.g=1:2:3", "--title", "two words"];
        assert_eq!(commands(page), [expected.map(str::to_owned).to_vec()]);
    }
}
