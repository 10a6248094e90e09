//! Says of a problem in a text file in which line it is.

/// "line 7 (`width = 0`)" for the line of `text` that holds the byte at `position`.
pub fn quote_line(text: &str, position: usize) -> String {
    let before = text.get(..position).unwrap_or(text);
    let number = before.matches('\n').count() + 1;
    let line = text.lines().nth(number - 1).unwrap_or_default().trim();
    format!("line {number} (`{line}`)")
}

/// What is wrong with `text`, which is no TOML or not what it should say, on one line: the line at fault, if it is known, and why.
pub fn toml_problem(text: &str, error: &toml::de::Error) -> String {
    let problem = error.message().split_whitespace().collect::<Vec<_>>().join(" ");
    match error.span() {
        Some(span) => format!("{}: {problem}", quote_line(text, span.start)),
        None => problem,
    }
}
