//! Tokenizer: words, quoted texts and brackets of a file.

use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;

use pt_scene::Warning;

use super::parameter::ParsedParameter;
use crate::LoadError;
use crate::pbrt::position::TokenPosition;
use crate::shared::names::quote;
use crate::shared::source_map;

/// Kind of a token.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum TokenKind<'a> {
    /// A directive, a number, `true` or `false`.
    Word(&'a str),
    /// Text in quotes, with escapes resolved.
    Text(Cow<'a, str>),
    /// `[`
    Open,
    /// `]`
    Close,
}

impl TokenKind<'_> {
    /// Describes the token, for messages.
    pub(super) fn describe(&self) -> String {
        match self {
            Self::Word(word) => quote(word),
            Self::Text(text) => format!("the text {}", quote(text)),
            Self::Open => "\"[\"".to_owned(),
            Self::Close => "\"]\"".to_owned(),
        }
    }
}

/// A token and its position.
#[derive(Clone, Debug)]
pub(super) struct Token<'a> {
    pub(super) kind: TokenKind<'a>,
    offset: usize,
    line: u32,
}

/// Iterates over the tokens of a file. `#` begins a comment, which ends with its line.
pub(super) struct Tokens<'a> {
    file: Arc<Path>,
    text: &'a str,
    next: usize,
    line: u32,
    ahead: Option<Token<'a>>,
    /// True after an error such as an unterminated text, which makes the rest of the file
    /// meaningless.
    is_broken: bool,
    /// Additional parameters of the last directive of the file, which follow the directive that
    /// includes the file.
    tail: Vec<ParsedParameter>,
    /// Warnings about the tokens read.
    pub(super) notes: Vec<Warning>,
}

impl<'a> Tokens<'a> {
    pub(super) fn new(text: &'a str, file: &Path) -> Self {
        let (file, tail, notes) = (file.into(), Vec::new(), Vec::new());
        Self { file, text, next: 0, line: 1, ahead: None, is_broken: false, tail, notes }
    }

    /// Creates the tokens of an included file, whose last directive continues with parameters of
    /// the including file.
    pub(super) fn included(text: &'a str, file: &Path, tail: Vec<ParsedParameter>) -> Self {
        Self { tail, ..Self::new(text, file) }
    }

    /// Returns the parameters with which the last directive continues, once the whole file is read.
    pub(super) fn take_tail(&mut self) -> Result<Vec<ParsedParameter>, LoadError> {
        Ok(if self.peek()?.is_none() { std::mem::take(&mut self.tail) } else { Vec::new() })
    }

    /// Position of a token.
    pub(super) fn place(&self, token: &Token<'_>) -> TokenPosition {
        self.place_of(token.offset, token.line)
    }

    /// Position of the end of the file.
    pub(super) fn end(&self) -> TokenPosition {
        self.place_of(self.text.len(), self.line)
    }

    fn place_of(&self, offset: usize, line: u32) -> TokenPosition {
        let column = source_map::column(self.text, offset);
        TokenPosition { file: Arc::clone(&self.file), line, column }
    }

    /// Returns the next token without consuming it.
    pub(super) fn peek(&mut self) -> Result<Option<&Token<'a>>, LoadError> {
        if self.ahead.is_none() {
            self.ahead = self.read()?;
        }
        Ok(self.ahead.as_ref())
    }

    /// Returns the next token; `None` at the end of the file.
    pub(super) fn take(&mut self) -> Result<Option<Token<'a>>, LoadError> {
        match self.ahead.take() {
            Some(token) => Ok(Some(token)),
            None => self.read(),
        }
    }

    /// Skips tokens up to the next word that `fits`. After an unreadable token there is none.
    pub(super) fn skip_to(&mut self, fits: impl Fn(&str) -> bool) -> Result<(), LoadError> {
        while let Some(token) = self.peek()? {
            if matches!(token.kind, TokenKind::Word(word) if fits(word)) {
                break;
            }
            self.ahead = None;
        }
        Ok(())
    }

    fn read(&mut self) -> Result<Option<Token<'a>>, LoadError> {
        if self.is_broken {
            return Ok(None);
        }
        let token = self.next_token();
        self.is_broken = token.is_err();
        token
    }

    fn next_token(&mut self) -> Result<Option<Token<'a>>, LoadError> {
        self.skip_blank();
        let (offset, line) = (self.next, self.line);
        let rest = &self.text[offset..];
        let Some(first) = rest.bytes().next() else { return Ok(None) };
        let kind = match first {
            b'[' => self.bracket(TokenKind::Open),
            b']' => self.bracket(TokenKind::Close),
            b'"' => self.quoted()?,
            _ => {
                let ends = |c: char| c.is_ascii_whitespace() || "[]\"#".contains(c);
                let length = rest.find(ends).unwrap_or(rest.len());
                self.next += length;
                TokenKind::Word(&rest[..length])
            }
        };
        Ok(Some(Token { kind, offset, line }))
    }

    fn bracket(&mut self, kind: TokenKind<'a>) -> TokenKind<'a> {
        self.next += 1;
        kind
    }

    fn skip_blank(&mut self) {
        let bytes = self.text.as_bytes();
        let mut in_comment = false;
        while let Some(&byte) = bytes.get(self.next) {
            match byte {
                b'\n' => {
                    in_comment = false;
                    self.line += 1;
                }
                b'#' => in_comment = true,
                _ if in_comment || byte.is_ascii_whitespace() => {}
                _ => return,
            }
            self.next += 1;
        }
    }

    /// Reads a text in quotes and resolves its escapes; it ends on its line.
    fn quoted(&mut self) -> Result<TokenKind<'a>, LoadError> {
        let start = self.next + 1;
        let rest = &self.text[start..];
        let mut escaped = false;
        for (i, c) in rest.char_indices() {
            match c {
                '\n' => break,
                _ if escaped => escaped = false,
                '\\' => escaped = true,
                '"' => {
                    self.next = start + i + 1;
                    let text = &rest[..i];
                    let text = if text.contains('\\') {
                        Cow::Owned(unescape(text).map_err(|c| {
                            let message = format!(
                                "found the unknown escape \\{c}; for a backslash, write \\\\"
                            );
                            self.place_of(start, self.line).error(message)
                        })?)
                    } else {
                        Cow::Borrowed(text)
                    };
                    return Ok(TokenKind::Text(text));
                }
                _ => {}
            }
        }
        let message = "unterminated text; expected a second \" on the same line";
        Err(self.place_of(self.next, self.line).error(message))
    }
}

/// Resolves `\"`, `\\`, `\'`, `\n`, `\t`, `\r`, `\b` and `\f`.
///
/// # Errors
/// The character after a backslash, if that is no escape.
fn unescape(text: &str) -> Result<String, char> {
    let mut result = String::with_capacity(text.len());
    let mut characters = text.chars();
    while let Some(c) = characters.next() {
        if c != '\\' {
            result.push(c);
            continue;
        }
        result.push(match characters.next() {
            Some(c @ ('"' | '\\' | '\'')) => c,
            Some('n') => '\n',
            Some('t') => '\t',
            Some('r') => '\r',
            Some('b') => '\u{8}',
            Some('f') => '\u{c}',
            Some(other) => return Err(other),
            None => return Err(' '),
        });
    }
    Ok(result)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kinds(text: &str) -> Result<Vec<TokenKind<'_>>, LoadError> {
        let mut tokens = Tokens::new(text, Path::new("a.pbrt"));
        let mut kinds = Vec::new();
        while let Some(token) = tokens.take()? {
            kinds.push(token.kind);
        }
        Ok(kinds)
    }

    #[test]
    fn words_texts_and_brackets_need_no_space_between_them() {
        let text = "Shape\"a b\"[1 -2]#c ]\n\"\\\"x\\\\\"";
        let expected = vec![
            TokenKind::Word("Shape"),
            TokenKind::Text("a b".into()),
            TokenKind::Open,
            TokenKind::Word("1"),
            TokenKind::Word("-2"),
            TokenKind::Close,
            TokenKind::Text("\"x\\".into()),
        ];
        assert_eq!(kinds(text).expect("tokens"), expected);
        assert_eq!(kinds(" # nothing").expect("tokens"), []);
    }

    #[test]
    fn places_are_lines_and_columns_in_characters() {
        let mut tokens = Tokens::new("é\n\u{e9}é \"x", Path::new("a.pbrt"));
        let first = tokens.take().expect("a token").expect("there is one");
        assert_eq!(tokens.place(&first).span("").to_string(), "a.pbrt:1:1");
        tokens.take().expect("a token");
        let error = tokens.take().expect_err("an open text").to_string();
        assert!(error.starts_with("a.pbrt:2:4: unterminated text"), "{error}");
        assert!(kinds("\"a\\qb\"").is_err());
        assert!(kinds("\"a\nb\"").is_err());
    }
}
