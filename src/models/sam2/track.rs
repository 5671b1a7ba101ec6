//! Video tracking of objects: prompts on some frames, masks on all, forward and backward. Frames are encoded once;
//! each object has a memory of its own.

use std::collections::{BTreeMap, BTreeSet};

use super::sequence::{Afresh, FrameSource, ObjectId, Output, TrackHistory, TrackStep};
use super::{Decoded, EncodedFrame, Sam2};
use crate::math::grid::regions;
use crate::math::resize::{Filter, resize};
use crate::models::ModelError;
use crate::models::tensor::Tensor;
use crate::scene::Mask;

/// Prompt for an object in a frame.
#[derive(Clone, Debug, PartialEq)]
pub enum Prompt {
    /// Points in px of the picture, `true` for foreground, and a box (left, top, right, bottom).
    Points {
        /// Points.
        points: Vec<([f32; 2], bool)>,
        /// Box around the object.
        around: Option<[f32; 4]>,
    },
    /// Mask of the object, of the picture's size.
    Mask(Mask),
}

/// State of one object, by frame.
#[derive(Clone, Debug, Default)]
struct Known {
    /// Prompted, not yet encoded into memory.
    pending: BTreeMap<usize, Output>,
    prompted: BTreeMap<usize, Output>,
    followed: BTreeMap<usize, Output>,
    /// Tracked frames; true if the pass went backward.
    passed: BTreeMap<usize, bool>,
    /// Prompted frames that had been tracked before.
    corrections: BTreeSet<usize>,
}

/// Sequence with its tracked objects.
pub struct Track<'a> {
    model: &'a mut Sam2,
    frames: &'a mut dyn FrameSource,
    /// Size of the pictures, px.
    size: (usize, usize),
    objects: BTreeMap<ObjectId, Known>,
}

/// Bound of the logits of a mask that is refined.
const CLAMP: f32 = 32.0;
/// Logit of a filled hole.
const FILLED: f32 = 0.1;
/// Score of an object whose mask is the prompt.
const GIVEN: f32 = 10.0;

impl<'a> Track<'a> {
    /// Starts a sequence of pictures of one size (width, height), without prompts.
    pub fn new(model: &'a mut Sam2, frames: &'a mut dyn FrameSource, size: (usize, usize)) -> Self {
        Self { model, frames, size, objects: BTreeMap::new() }
    }

    /// Prompts an object in a frame.
    pub fn prompt(&mut self, frame: usize, object: ObjectId, prompt: &Prompt) -> Result<(), ModelError> {
        self.objects.entry(object).or_default();
        let out = match prompt {
            Prompt::Points { points, around } => self.of_points(frame, object, points, *around)?,
            Prompt::Mask(mask) => self.of_mask(frame, mask)?,
        };
        let known = self.objects.entry(object).or_default();
        known.pending.insert(frame, out);
        if known.passed.contains_key(&frame) {
            known.corrections.insert(frame);
        }
        Ok(())
    }

    fn of_points(
        &mut self,
        frame: usize,
        object: ObjectId,
        points: &[([f32; 2], bool)],
        around: Option<[f32; 4]>,
    ) -> Result<Output, ModelError> {
        let side = self.model.about.image_size as f32;
        let scaled = |x: f32, y: f32| [x / self.size.0 as f32 * side, y / self.size.1 as f32 * side];
        let corners = around.into_iter().flat_map(|[l, t, r, b]| [(scaled(l, t), 2.0), (scaled(r, b), 3.0)]);
        let marks = points.iter().map(|([x, y], inside)| (scaled(*x, *y), f32::from(u8::from(*inside))));
        let all: Vec<([f32; 2], f32)> = corners.chain(marks).collect();
        let known = &self.objects[&object];
        let earlier = known.pending.get(&frame).or_else(|| known.prompted.get(&frame));
        let earlier = earlier.or_else(|| known.followed.get(&frame)).map(|out| {
            let mut logits = out.logits.clone();
            logits.values.iter_mut().for_each(|v| *v = v.clamp(-CLAMP, CLAMP));
            logits
        });
        let passed = known.passed.get(&frame).copied();
        let image = self.frames.get(self.model, frame)?;
        let embeddings = match passed {
            None => self.model.without_memory(&image),
            Some(backward) => self.recall(&image, object, frame, backward)?,
        };
        let three = self.may_be_three(passed.is_none(), all.len());
        let mut out = self.decode(&image, &embeddings, &all, earlier, three)?;
        self.fill(&mut out.logits);
        Ok(out)
    }

    fn of_mask(&mut self, frame: usize, mask: &Mask) -> Result<Output, ModelError> {
        let side = self.model.about.image_size;
        let (w, h) = (mask.width_px(), mask.height_px());
        let plane: Vec<f32> = (0..w * h).map(|i| f32::from(u8::from(mask.contains(i)))).collect();
        let square = resize(&plane, (w, h), (side, side), Filter::Bilinear);
        let square: Vec<f32> = square.into_iter().map(|v| f32::from(u8::from(v >= 0.5))).collect();
        let is_there = square.contains(&1.0);
        let (as_prompt, logits) = self.model.mask_prompt(Tensor::new(&[1, 1, side, side], square))?;
        // The pointer comes from the decoder, prompted with the mask and without memory; the mask itself is kept
        // unchanged.
        let image = self.frames.get(self.model, frame)?;
        let embeddings = image.embeddings.clone();
        let mut out = self.decode(&image, &embeddings, &[], Some(as_prompt), false)?;
        out.logits = logits;
        self.fill(&mut out.logits);
        out.score = if is_there { GIVEN } else { -GIVEN };
        if !is_there {
            out.pointer = self.model.no_pointer();
        }
        Ok(out)
    }

    fn may_be_three(&self, conditioning: bool, points: usize) -> bool {
        let [fewest, most] = self.model.about.multimask_points;
        (conditioning || self.model.about.multimask_when_tracking) && (fewest..=most).contains(&points)
    }

    /// Decodes the best mask of one object in a frame, its pointer, and its presence score.
    fn decode(
        &mut self,
        frame: &EncodedFrame,
        embeddings: &Tensor,
        points: &[([f32; 2], f32)],
        mask: Option<Tensor>,
        three: bool,
    ) -> Result<Output, ModelError> {
        // The decoder expects a padding point (label -1) at the end, and another one if there are no points.
        let none = ([0.0; 2], -1.0);
        let padding = if points.is_empty() { 2 } else { 1 };
        let all: Vec<([f32; 2], f32)> = points.iter().copied().chain(std::iter::repeat_n(none, padding)).collect();
        let n = all.len();
        let coords = Tensor::new(&[1, n, 2], all.iter().flat_map(|p| p.0).collect());
        let labels = Tensor::new(&[1, n], all.iter().map(|p| p.1).collect());
        let decoded = self.model.decode(frame, embeddings, coords, labels, mask)?;
        let (which, pointer) = self.choose(&decoded, three);
        let low = decoded.masks.shape[3];
        let plane = |i: usize| decoded.masks.values[i * low * low..(i + 1) * low * low].to_vec();
        let absent = self.model.about.absent_score;
        let logits = if decoded.score <= 0.0 { vec![absent; low * low] } else { plane(which) };
        let c = decoded.pointers.shape[2];
        Ok(Output {
            logits: Tensor::new(&[1, 1, low, low], logits),
            pointer: Tensor::new(&[1, c], decoded.pointers.values[pointer * c..(pointer + 1) * c].to_vec()),
            score: decoded.score,
            memory: None,
        })
    }

    /// Selects one of the four masks, and the mask whose pointer is kept.
    fn choose(&self, decoded: &Decoded, three: bool) -> (usize, usize) {
        let about = &self.model.about;
        // `max_by` returns the last of equals; reversed, it is the first.
        let best = (1..4).rev().max_by(|&a, &b| decoded.iou.values[a].total_cmp(&decoded.iou.values[b])).unwrap_or(1);
        if three {
            return (best, if about.pointer_of_best_mask { best } else { 0 });
        }
        if about.single_mask_falls_back {
            let low = decoded.masks.shape[3];
            let above = |t: f32| decoded.masks.values[..low * low].iter().filter(|v| **v > t).count() as f32;
            let (inner, outer) = (above(about.stability_delta), above(-about.stability_delta));
            let stability = if outer > 0.0 { inner / outer } else { 1.0 };
            if stability < about.stability_threshold {
                return (best, 0);
            }
        }
        (0, 0)
    }

    fn fill(&self, logits: &mut Tensor) {
        let most = self.model.about.fill_hole_area;
        if most == 0 {
            return;
        }
        let low = logits.shape[3];
        let (label, areas) = regions(low, logits.values.len(), |i| logits.values[i] <= 0.0);
        for (v, label) in logits.values.iter_mut().zip(label) {
            if label > 0 && areas[label as usize - 1] <= most {
                *v = FILLED;
            }
        }
    }

    /// Returns a frame's embeddings, conditioned on the memory of an object.
    fn recall(
        &mut self,
        image: &EncodedFrame,
        object: ObjectId,
        frame: usize,
        backward: bool,
    ) -> Result<Tensor, ModelError> {
        let about = &self.model.about;
        let known = &self.objects[&object];
        let (chosen, others) = closest(&known.prompted, frame, about.max_conditioning_frames);
        let before = |age: usize| if backward { frame.checked_add(age) } else { frame.checked_sub(age) };
        let at = |t: usize| known.followed.get(&t).or_else(|| others.get(&t).copied());
        let mut memories: Vec<(i64, &Tensor)> = Vec::new();
        for out in chosen.values() {
            memories.extend(out.memory.as_ref().map(|m| (about.memories as i64 - 1, m)));
        }
        // Oldest first.
        for age in (1..about.memories).rev() {
            let memory = before(age).and_then(at).and_then(|out| out.memory.as_ref());
            memories.extend(memory.map(|m| (age as i64 - 1, m)));
        }
        let most = self.frames.len().min(about.pointers);
        let mut pointers: Vec<(f32, &Tensor)> = Vec::new();
        let offset = |distance: f32| distance / most.saturating_sub(1).max(1) as f32;
        for (&t, out) in &chosen {
            let ahead = if backward { t as i64 - frame as i64 } else { frame as i64 - t as i64 };
            if ahead < 0 && about.pointers_only_from_past {
                continue;
            }
            let distance = if about.pointer_time_signed { ahead } else { ahead.abs() };
            pointers.push((offset(distance as f32), &out.pointer));
        }
        for age in 1..most {
            let Some(t) = before(age).filter(|t| *t < self.frames.len()) else { break };
            pointers.extend(at(t).map(|out| (offset(age as f32), &out.pointer)));
        }
        self.model.condition(image, &memories, &pointers)
    }

    /// Encodes new prompts into memory.
    fn settle(&mut self) -> Result<(), ModelError> {
        let ids: Vec<ObjectId> = self.objects.keys().copied().collect();
        for id in ids {
            let pending = self.objects.get_mut(&id).map(|k| std::mem::take(&mut k.pending)).unwrap_or_default();
            for (frame, mut out) in pending {
                let image = self.frames.get(self.model, frame)?;
                let binarise = self.model.about.binarise_prompted;
                out.memory = Some(self.model.remember(&image, &out.logits, out.score, binarise)?);
                let known = self.objects.entry(id).or_default();
                let list = if known.corrections.remove(&frame) { &mut known.followed } else { &mut known.prompted };
                list.insert(frame, out);
            }
            let known = self.objects.entry(id).or_default();
            known.followed.retain(|frame, _| !known.prompted.contains_key(frame));
        }
        Ok(())
    }

    /// Tracks all objects from the first prompted frame on, or back from it. `seen` receives every frame with its
    /// objects, and returns false to stop.
    pub fn run(
        &mut self,
        backward: bool,
        seen: impl FnMut(usize, &BTreeMap<ObjectId, Output>) -> bool,
    ) -> Result<(), ModelError> {
        self.resume(backward, &mut Afresh, seen)
    }

    /// Tracks as [`Self::run`] does, reusing the outputs of an interrupted track in `history`.
    pub fn resume(
        &mut self,
        backward: bool,
        history: &mut dyn TrackHistory,
        mut seen: impl FnMut(usize, &BTreeMap<ObjectId, Output>) -> bool,
    ) -> Result<(), ModelError> {
        self.settle()?;
        let start = self.objects.values().flat_map(|k| k.prompted.keys()).min().copied();
        let start = start.ok_or(ModelError::NothingMarked)?;
        let order: Vec<usize> = match backward {
            false => (start..self.frames.len()).collect(),
            true if start > 0 => (0..=start).rev().collect(),
            true => Vec::new(),
        };
        for frame in order {
            let ids: Vec<ObjectId> = self.objects.keys().copied().collect();
            let mut found = BTreeMap::new();
            for id in ids {
                let out = match self.objects[&id].prompted.get(&frame) {
                    Some(out) => out.clone(),
                    None => self.follow(TrackStep { object: id, frame, backward }, history)?,
                };
                self.objects.entry(id).or_default().passed.insert(frame, backward);
                found.insert(id, out);
            }
            if !seen(frame, &found) {
                return Ok(());
            }
        }
        Ok(())
    }

    fn follow(&mut self, step: TrackStep, history: &mut dyn TrackHistory) -> Result<Output, ModelError> {
        let out = match history.earlier(step) {
            Some(out) => out,
            None => {
                let image = self.frames.get(self.model, step.frame)?;
                let embeddings = self.recall(&image, step.object, step.frame, step.backward)?;
                let three = self.may_be_three(false, 0);
                let mut out = self.decode(&image, &embeddings, &[], None, three)?;
                out.memory = Some(self.model.remember(&image, &out.logits, out.score, false)?);
                self.fill(&mut out.logits);
                history.keep(step, &out);
                out
            }
        };
        self.objects.entry(step.object).or_default().followed.insert(step.frame, out.clone());
        Ok(out)
    }
}

/// Mask of an object in a picture of `size` px.
pub fn mask_of(out: &Output, size: (usize, usize)) -> Mask {
    let low = out.logits.shape[3];
    let full = resize(&out.logits.values, (low, low), size, Filter::Linear);
    Mask::from_fn(size.0, size.1, |i| full[i] > 0.0)
}

type Chosen<'a> = BTreeMap<usize, &'a Output>;

/// Splits the prompted frames into the `most` that condition a frame and the rest: first the nearest before, then
/// the nearest from here on, then by distance.
fn closest(prompted: &BTreeMap<usize, Output>, frame: usize, most: i64) -> (Chosen<'_>, Chosen<'_>) {
    let all = || prompted.iter().map(|(t, out)| (*t, out));
    let Some(most) = usize::try_from(most).ok().filter(|most| prompted.len() > *most) else {
        return (all().collect(), Chosen::new());
    };
    let before = prompted.range(..frame).next_back().map(|(t, _)| *t);
    let after = prompted.range(frame..).next().map(|(t, _)| *t);
    let mut order: Vec<usize> = before.into_iter().chain(after).collect();
    let mut rest: Vec<usize> = prompted.keys().copied().filter(|t| !order.contains(t)).collect();
    rest.sort_by_key(|t| t.abs_diff(frame));
    order.extend(rest);
    order.truncate(most.max(1));
    all().partition(|(t, _)| order.contains(t))
}
