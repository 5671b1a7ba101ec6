//! The real embeddings of the LERF scene teatime: its identities, further views of them, its queries and those of others.

use fmlgs::pipeline::semantics::query::by_embedding::TextEmbeddings;
use fmlgs::pipeline::semantics::query::parse::ParsedQuery;
use fmlgs::pipeline::semantics::query::recipe::{PAPERS_PHRASES, QueryConfig};
use fmlgs::pipeline::semantics::relevancy::{advantage, deviate};
use fmlgs::scene::{Identities, LanguageFeatures, Level, NO_IDENTITY, ViewFeatures};

/// Queries of the LERF evaluation that have an embedding.
pub const QUERIES: [&str; 17] = [
    "apple",
    "bag of cookies",
    "bear nose",
    "coffee",
    "coffee mug",
    "dall-e brand",
    "glass of water",
    "hooves",
    "napkin",
    "paper napkin",
    "plate",
    "sheep",
    "spoon",
    "stuffed bear",
    "tea in a glass",
    "three cookies",
    "yellow pouf",
];

/// Phrases of other scenes: nothing of it is in this one.
pub const ABSENT: &str = "pink ice cream, Stainless steel pots, pot, toy elephant, pirate hat, kamaboko, chopsticks, toilet, \
    toy cat statue, ketchup, rubics cube, refrigerator, jake, wavy noodles, rubber duck with hat, egg, showercurtain, books, \
    ceiling, pikachu, frog cup, blinds, tesla door handle, corn, sink, miffy, pumpkin, bathtub, person, onion segments, \
    red toy chair, spatula, nightstand, television, rubber duck with buoy, nori, dresser, porcelain hand, bookshelf, \
    ottolenghi, sake cup, green toy chair, pour-over vessel, mirror, toaster, plastic ladle, old camera, waldo";

pub struct Scene {
    /// One view of each identity.
    pub single: Vec<Vec<f32>>,
    /// Further views of each.
    pub many: Vec<Vec<Vec<f32>>>,
    pub texts: Vec<(String, Vec<f32>)>,
}

fn rows<T: npyz::Deserialize, U>(folder: &std::path::Path, name: &str, to: impl Fn(T) -> U) -> Vec<Vec<U>> {
    let bytes = std::fs::read(folder.join(name)).expect("readable");
    let file = npyz::NpyFile::new(&bytes[..]).expect("a NumPy array");
    let width = file.shape()[1] as usize;
    let all: Vec<U> = file.into_vec::<T>().expect("the type").into_iter().map(to).collect();
    let mut all = all.into_iter();
    (0..all.len() / width).map(|_| all.by_ref().take(width).collect()).collect()
}

pub fn load() -> Option<Scene> {
    let folder = crate::common::data("clip/teatime_identities")?;
    let half = |name: &str| rows::<half::f16, f32>(&folder, name, half::f16::to_f32);
    let codes = |name: &str| rows::<u8, u8>(&folder, name, |c| c);
    let single = half("image_embeddings.npy");
    let of_single = codes("image_embeddings_codes.npy");
    let (views, of_views) = (half("image_embeddings_multiview.npy"), codes("image_embeddings_multiview_codes.npy"));
    let of = |code: &Vec<u8>| views.iter().zip(&of_views).filter(|(_, c)| *c == code).map(|(v, _)| v.clone()).collect();
    let many = of_single.iter().map(of).collect();
    let names = std::fs::read_to_string(folder.join("text_names.txt")).expect("readable");
    let names = names.lines().filter(|l| !l.is_empty()).map(str::to_owned);
    let texts = names.zip(rows::<f32, f32>(&folder, "text_embeddings.npy", |x| x)).collect();
    Some(Scene { single, many, texts })
}

impl Scene {
    pub fn text(&self, name: &str) -> Vec<f32> {
        self.texts.iter().find(|t| t.0 == name).unwrap_or_else(|| panic!("{name}")).1.clone()
    }

    /// Embeddings of questions and of all phrases that answering them by `recipe` needs, as far as there are any.
    pub fn phrases<'q>(&self, questions: impl IntoIterator<Item = &'q str>, recipe: &QueryConfig) -> TextEmbeddings {
        let mut phrases = TextEmbeddings::default();
        let mut known =
            |p: &str| self.texts.iter().find(|t| t.0.eq_ignore_ascii_case(p)).map(|t| t.1.clone()).ok_or(());
        for question in questions {
            phrases.learn(&plain(question), recipe, &mut known).expect("known");
        }
        phrases
    }

    /// Four views of each identity, as many as a scene keeps; the nose is a part of the bear, deviated by `weight`.
    pub fn language(&self, weight: f32) -> (Identities, LanguageFeatures) {
        let (bear, nose) = (self.best("stuffed bear"), self.best("bear nose"));
        let mut order: Vec<usize> = (0..self.single.len()).filter(|k| ![bear, nose].contains(k)).collect();
        order.splice(0..0, [bear, nose]);
        let mut identities = Identities::default();
        let mut by_identity = Vec::new();
        for (id, k) in order.into_iter().enumerate() {
            let (level, parent) = if id == 1 { (Level::Part, 1) } else { (Level::Object, NO_IDENTITY) };
            identities.add(level, parent, Vec::new());
            let raw: Vec<Vec<f32>> =
                std::iter::once(&self.single[k]).chain(self.many[k].iter().take(3)).cloned().collect();
            let moved = |v: &Vec<f32>| deviate(v, &self.single[bear], weight).expect("a direction");
            let deviated = if id == 1 { raw.iter().map(moved).collect() } else { raw.clone() };
            by_identity.push(ViewFeatures { raw, deviated });
        }
        (identities, LanguageFeatures { encoder: "clip".into(), dimension: 512, by_identity })
    }

    pub fn canonical(&self) -> Vec<Vec<f32>> {
        PAPERS_PHRASES.iter().map(|c| self.text(c)).collect()
    }

    /// Advantages of all identities for a query.
    pub fn advantages(&self, query: &str) -> Vec<f32> {
        let (q, canonical) = (self.text(query), self.canonical());
        self.single.iter().map(|f| advantage(f, &q, &canonical)).collect()
    }

    pub fn best(&self, query: &str) -> usize {
        let d = self.advantages(query);
        (0..d.len()).max_by(|&a, &b| d[a].total_cmp(&d[b])).expect("identities")
    }
}

/// A question that says of no piece what it is a piece of.
pub fn plain(text: &str) -> ParsedQuery {
    ParsedQuery { text: text.to_lowercase(), target: text.to_lowercase(), whole: None }
}
