//! Forms of commands: expanded into plain sequences of words and slots, then matched against a request. A form
//! matches only if it accounts for every word of the request.

use std::collections::HashMap;
use std::path::Path;
use std::sync::OnceLock;

use crate::agent::camera_args::{Direction, Distance};
use crate::agent::language::{CommandHelp, CommandLanguage, commands, find};
use crate::agent::names::NameWords;
use crate::agent::relation::Relation;
use crate::agent::words::{Token, number};
use crate::jobs::locate::is_picture;
use crate::navigate::target::Side;
use crate::pipeline::semantics::query::language::words::{LanguageWords, WordClass};
use crate::scene::identity::whole_names::key;

/// Kind of a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FormSlot {
    Thing,
    Things,
    Kind,
    Name,
    Side,
    Relation,
    Direction,
    Turn,
    Distance,
    Angle,
    Most,
    Photo,
    Folder,
}

/// Item of a form: a fixed word or a slot.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum FormItem {
    Word(String),
    Slot(FormSlot),
}

impl FormItem {
    /// Fixed word; `None` for a slot.
    pub(super) fn word(&self) -> Option<&str> {
        if let Self::Word(word) = self { Some(word) } else { None }
    }
}

/// Form without alternatives, and its command.
pub(super) struct Sequence {
    pub(crate) items: Vec<FormItem>,
    pub(crate) command: &'static CommandHelp,
}

/// Values of the slots of a form.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Slots {
    pub(super) texts: Vec<String>,
    /// Number of words in the slots of things.
    pub(super) named: usize,
    /// Several things that stand for the text with this index.
    pub(super) several: Option<(usize, Vec<String>)>,
    pub(super) name: Option<String>,
    pub(super) side: Option<Side>,
    pub(super) relation: Option<Relation>,
    pub(super) direction: Option<Direction>,
    pub(super) distance: Option<Distance>,
    pub(super) degrees: Option<f64>,
    pub(super) most: Option<String>,
    /// File of a photo or folder of photos, as typed.
    pub(super) photo: Option<String>,
}

/// All sequences, in the order of the commands.
pub(super) fn sequences() -> &'static [Sequence] {
    static ALL: OnceLock<Vec<Sequence>> = OnceLock::new();
    ALL.get_or_init(|| {
        let of = |command: &'static CommandHelp| {
            command.forms.iter().flat_map(|f| expand(f)).map(move |items| Sequence { items, command })
        };
        commands().iter().flat_map(of).collect()
    })
}

/// Sequences that may begin with a word, in the order of the commands.
pub(super) fn beginning_with(word: &str) -> impl Iterator<Item = &'static Sequence> {
    static FIRST: OnceLock<HashMap<&str, Vec<usize>>> = OnceLock::new();
    let first = |sequence: &'static Sequence| match sequence.items.first() {
        Some(FormItem::Word(word)) => word.as_str(),
        // A slot may begin with any word.
        _ => "",
    };
    let table = FIRST.get_or_init(|| {
        let mut table: HashMap<&str, Vec<usize>> = HashMap::new();
        sequences().iter().enumerate().for_each(|(i, s)| table.entry(first(s)).or_default().push(i));
        table
    });
    let of = |word: &str| table.get(word).map(Vec::as_slice).unwrap_or_default();
    let mut all = [of(word), of("")].concat();
    all.sort_unstable();
    all.into_iter().map(|i| &sequences()[i])
}

/// Expands a form into its sequences.
pub(super) fn expand(form: &str) -> Vec<Vec<FormItem>> {
    let spaced = ['(', ')', '[', ']', '|'].iter().fold(form.to_owned(), |f, c| f.replace(*c, &format!(" {c} ")));
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let mut at = 0;
    alternatives(&words, &mut at)
}

fn alternatives(words: &[&str], at: &mut usize) -> Vec<Vec<FormItem>> {
    let (mut done, mut open): (Vec<Vec<FormItem>>, Vec<Vec<FormItem>>) = (Vec::new(), vec![Vec::new()]);
    while let Some(word) = words.get(*at) {
        let more = match *word {
            ")" | "]" => break,
            "|" => {
                done.append(&mut open);
                open = vec![Vec::new()];
                *at += 1;
                continue;
            }
            "(" | "[" => {
                *at += 1;
                let mut inner = alternatives(words, at);
                if *word == "[" {
                    inner.push(Vec::new());
                }
                inner
            }
            word => vec![vec![item(word)]],
        };
        *at += 1;
        open = open.iter().flat_map(|o| more.iter().map(|m| [o.as_slice(), m.as_slice()].concat())).collect();
    }
    done.append(&mut open);
    done
}

fn item(word: &str) -> FormItem {
    FormItem::Slot(match word {
        "{thing}" => FormSlot::Thing,
        "{things}" => FormSlot::Things,
        "{kind}" => FormSlot::Kind,
        "{name}" => FormSlot::Name,
        "{side}" => FormSlot::Side,
        "{relation}" => FormSlot::Relation,
        "{direction}" => FormSlot::Direction,
        "{turn}" => FormSlot::Turn,
        "{distance}" => FormSlot::Distance,
        "{angle}" => FormSlot::Angle,
        "{most}" => FormSlot::Most,
        "{photo}" => FormSlot::Photo,
        "{folder}" => FormSlot::Folder,
        word => return FormItem::Word(word.to_owned()),
    })
}

/// Request to match against the sequences.
pub(super) struct FormRequest<'a> {
    /// All of the text, which the tokens have their places in.
    pub(crate) text: &'a str,
    pub(crate) tokens: &'a [Token],
    pub(crate) words: &'a [&'a str],
    pub(crate) known: &'a NameWords<'a>,
    pub(crate) things: Things,
}

/// Rule for the words that may name a thing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Things {
    /// Complete names only.
    Whole,
    /// Words of names in the scene.
    Known,
    /// Any words.
    Any,
}

impl FormRequest<'_> {
    /// Returns the values of the slots if the request matches a sequence.
    pub(super) fn fit(&self, items: &[FormItem]) -> Option<Slots> {
        let mut slots = Slots::default();
        self.rest(items, 0, &mut slots).then_some(slots)
    }

    fn rest(&self, items: &[FormItem], at: usize, slots: &mut Slots) -> bool {
        let Some((first, items)) = items.split_first() else { return at == self.words.len() };
        match first {
            FormItem::Word(word) => self.words.get(at) == Some(&word.as_str()) && self.rest(items, at + 1, slots),
            // Longest match first: "left stick", not "left".
            FormItem::Slot(slot) => (at + 1..=self.words.len()).rev().any(|end| {
                let before = slots.clone();
                let fits = self.take(*slot, at, end, slots) && self.rest(items, end, slots);
                if !fits {
                    *slots = before;
                }
                fits
            }),
        }
    }

    fn is_thing(&self, words: &[&str]) -> bool {
        match self.things {
            Things::Whole => self.known.whole(words).is_some(),
            Things::Known => self.known.is_thing(words, true),
            Things::Any => self.known.is_thing(words, false),
        }
    }

    /// Joins words to a phrase: the complete name that they match, else the words as typed.
    fn joined(&self, words: &[&str]) -> String {
        let said = quoted(words);
        self.known.whole(words).filter(|name| key(name) != key(&said)).map_or(said, str::to_owned)
    }

    /// File or folder that the words from `at` to `end` name, as typed, if `is_one` says that it is one.
    fn path(&self, at: usize, end: usize, is_one: fn(&str) -> bool) -> Option<String> {
        let (first, last) = (self.tokens.get(at)?, self.tokens.get(end - 1)?);
        let typed = self.text.get(first.at.start..last.at.end).filter(|typed| is_one(typed))?;
        Some(typed.trim_matches(|c: char| QUOTES.contains(c)).trim().to_owned())
    }

    /// Fills a slot with the words from `at` to `end`; returns whether they fit.
    fn take(&self, slot: FormSlot, at: usize, end: usize, slots: &mut Slots) -> bool {
        let words = &self.words[at..end];
        let text = words.join(" ");
        let (language, vocabulary) = (CommandLanguage::get(), LanguageWords::get());
        match slot {
            FormSlot::Thing => {
                slots.named += words.len();
                slots.texts.push(self.joined(words));
                self.is_thing(words)
            }
            FormSlot::Kind => {
                slots.texts.push(self.joined(words));
                let words = if words[0] == "all" { &words[1..] } else { words };
                // With complete names, a kind must not take in a relation such as "on the table".
                let is_plain =
                    self.things != Things::Whole || !words.iter().any(|w| vocabulary.is(WordClass::NoName, w));
                self.known.whole(words).is_some() || is_plain && self.known.is_thing(words, self.things != Things::Any)
            }
            FormSlot::Things => {
                let parts: Vec<&[&str]> =
                    words.split(|w| matches!(*w, "," | "and")).filter(|p| !p.is_empty()).collect();
                let parts = if self.is_thing(words) { vec![words] } else { parts };
                slots.named += words.len();
                slots.several = Some((slots.texts.len(), parts.iter().map(|p| self.joined(p)).collect()));
                slots.texts.push(text);
                !parts.is_empty() && parts.iter().all(|p| self.is_thing(p))
            }
            FormSlot::Name => {
                let raw: Vec<&str> = self.tokens[at..end].iter().map(|t| t.raw.as_str()).collect();
                slots.name = Some(raw.join(" ").replace(" 's", "'s"));
                !words.contains(&",")
            }
            FormSlot::Side => {
                slots.side = find(&language.sides, text.strip_suffix(" side").unwrap_or(&text));
                slots.side.is_some()
            }
            FormSlot::Relation => {
                slots.relation = vocabulary.relation(words).filter(|(_, n)| *n == words.len()).map(|(r, _)| r);
                slots.relation.is_some()
            }
            FormSlot::Direction | FormSlot::Turn => {
                slots.direction = find(&language.directions, &text)
                    .filter(|d| slot == FormSlot::Direction || Direction::TURNS.contains(d));
                slots.direction.is_some()
            }
            FormSlot::Distance => {
                slots.distance = distance(words);
                slots.distance.is_some()
            }
            FormSlot::Angle => {
                slots.degrees = find(&language.angles, &text).or_else(|| angle(words));
                slots.degrees.is_some()
            }
            FormSlot::Photo => {
                slots.photo = self.path(at, end, is_file);
                slots.photo.is_some()
            }
            FormSlot::Folder => {
                slots.photo = self.path(at, end, is_folder);
                slots.photo.is_some()
            }
            FormSlot::Most => {
                slots.most = Some(text);
                vocabulary.order(words[0]).is_some_and(|o| o.superlative) && words.len() == 1
            }
        }
    }
}

/// Quotation marks around a file's name.
const QUOTES: &str = "\"'\u{201c}\u{201d}";

/// Returns whether a text is the name of one picture file; what is in quotes may have any words.
pub(super) fn is_file(text: &str) -> bool {
    let joins = |word: &str| matches!(word, "and" | "then") || word.ends_with(',');
    let is_one = text.starts_with(|c: char| QUOTES.contains(c)) || !text.split_whitespace().any(joins);
    is_one && is_picture(Path::new(text.trim_matches(|c: char| QUOTES.contains(c))))
}

/// Returns whether a text is the path of a folder: in quotes, or one word with a separator.
pub(super) fn is_folder(text: &str) -> bool {
    let inside = text.trim_matches(|c: char| QUOTES.contains(c)).trim();
    let is_quoted = text.starts_with(|c: char| QUOTES.contains(c)) && !inside.contains(|c: char| QUOTES.contains(c));
    !inside.is_empty() && (is_quoted || !text.contains(char::is_whitespace) && text.contains(['/', '\\']))
}

fn quoted(words: &[&str]) -> String {
    words.join(" ").replace(" 's", "'s").replace('"', "")
}

/// Reads an amount: "20", "half a", "thirty five".
fn amount(words: &[&str]) -> Option<f64> {
    match words {
        [only] => number(only).or_else(|| find(&CommandLanguage::get().amounts, only)),
        [tens, ones] if number(ones).is_some_and(|n| n < 10.0) => {
            Some(number(tens).filter(|n| *n >= 20.0)? + number(ones)?)
        }
        _ => find(&CommandLanguage::get().amounts, &words.join(" ")),
    }
}

/// Reads a distance: "20 cm", "half a meter", "two steps", "a bit".
fn distance(words: &[&str]) -> Option<Distance> {
    let (language, (unit, before)) = (CommandLanguage::get(), words.split_last()?);
    if let Some(steps) = find(&language.steps, &words.join(" ")) {
        return Some(Distance::Relative(steps));
    }
    let amount = amount(before)?;
    let meters = find(&language.units, unit).map(|meters| Distance::Meters(amount * meters));
    meters.or_else(|| matches!(*unit, "step" | "steps").then_some(Distance::Relative(amount)))
}

/// Reads an angle in degrees: "90 degrees".
fn angle(words: &[&str]) -> Option<f64> {
    let (unit, before) = words.split_last()?;
    if matches!(*unit, "°" | "deg" | "degree" | "degrees") { amount(before) } else { None }
}
