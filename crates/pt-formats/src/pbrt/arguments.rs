//! Arguments of directives without a parameter list: texts and numbers, optionally in brackets.

use super::position::TokenPosition;
use super::token::{Token, TokenKind, Tokens};
use crate::LoadError;
use crate::shared::number::number;

/// Reads a text in quotes.
pub(super) fn text(tokens: &mut Tokens<'_>, at: &TokenPosition) -> Result<String, LoadError> {
    let has_bracket = matches!(tokens.peek()?, Some(Token { kind: TokenKind::Open, .. }));
    if has_bracket {
        tokens.take()?;
    }
    let text = match tokens.take()? {
        Some(Token { kind: TokenKind::Text(text), .. }) => text.into_owned(),
        Some(token) => {
            let message = format!("found {}, expected a text in quotes", token.kind.describe());
            return Err(tokens.place(&token).error(message));
        }
        None => return Err(at.error("found the end of the file, expected a text in quotes")),
    };
    if has_bracket {
        close(tokens, at)?;
    }
    Ok(text)
}

/// Reads `N` numbers, optionally in brackets.
pub(super) fn numbers<const N: usize>(
    tokens: &mut Tokens<'_>,
    at: &TokenPosition,
) -> Result<[f64; N], LoadError> {
    let has_bracket = matches!(tokens.peek()?, Some(Token { kind: TokenKind::Open, .. }));
    if has_bracket {
        tokens.take()?;
    }
    let mut numbers = [0.0; N];
    for (i, x) in numbers.iter_mut().enumerate() {
        *x = match tokens.take()? {
            Some(Token { kind: TokenKind::Word(word), .. }) => {
                number(word).map_err(|message| at.error(message))?
            }
            Some(token) => {
                let message =
                    format!("found {}, expected number {} of {N}", token.kind.describe(), i + 1);
                return Err(tokens.place(&token).error(message));
            }
            None => {
                return Err(at.error(format!(
                    "found the end of the file, expected number {} of {N}",
                    i + 1
                )));
            }
        };
    }
    if has_bracket {
        close(tokens, at)?;
    }
    Ok(numbers)
}

fn close(tokens: &mut Tokens<'_>, at: &TokenPosition) -> Result<(), LoadError> {
    match tokens.take()? {
        Some(Token { kind: TokenKind::Close, .. }) => Ok(()),
        Some(token) => {
            let message = format!("found {}, expected \"]\"", token.kind.describe());
            Err(tokens.place(&token).error(message))
        }
        None => Err(at.error("found the end of the file, expected \"]\"")),
    }
}

/// Reads which of the two transforms are active.
pub(super) fn active(tokens: &mut Tokens<'_>, at: &TokenPosition) -> Result<[bool; 2], LoadError> {
    match tokens.take()? {
        Some(Token { kind: TokenKind::Word("All"), .. }) => Ok([true; 2]),
        Some(Token { kind: TokenKind::Word("StartTime"), .. }) => Ok([true, false]),
        Some(Token { kind: TokenKind::Word("EndTime"), .. }) => Ok([false, true]),
        _ => Err(at.error("expected ActiveTransform All, StartTime or EndTime")),
    }
}
