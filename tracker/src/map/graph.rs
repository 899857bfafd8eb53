//! Which tags are seen together.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use super::{MapError, View};
use crate::detection::TagId;

/// Loops that are looked at, at most: seconds.
const MOST_LOOPS: usize = 20_000_000;

/// Tags as nodes; an edge for each pair that some view shows.
pub(super) struct Graph {
    neighbours: BTreeMap<TagId, BTreeSet<TagId>>,
}

impl Graph {
    pub fn new(views: &[View]) -> Self {
        let mut neighbours: BTreeMap<TagId, BTreeSet<TagId>> = BTreeMap::new();
        for view in views {
            let tags: BTreeSet<TagId> = view.observations.iter().map(|seen| seen.tag).collect();
            for tag in &tags {
                neighbours.entry(*tag).or_default().extend(tags.iter().filter(|other| *other != tag));
            }
        }
        Self { neighbours }
    }

    /// All tags, sorted.
    pub fn tags(&self) -> Vec<TagId> {
        self.neighbours.keys().copied().collect()
    }

    pub fn neighbours(&self, tag: TagId) -> impl Iterator<Item = TagId> + '_ {
        self.neighbours.get(&tag).into_iter().flatten().copied()
    }

    /// The group of the origin, else the largest, and the others; each sorted, the larger first.
    pub fn split(
        &self,
        origin: Option<TagId>,
        views: usize,
    ) -> Result<(Vec<TagId>, Vec<Vec<TagId>>), MapError> {
        let mut groups = self.groups();
        groups.sort_by_key(|group| std::cmp::Reverse(group.len()));
        if groups.first().is_none_or(|group| group.len() < 2) {
            return Err(MapError::NoPairs { views });
        }
        let index = match origin {
            None => 0,
            Some(tag) => groups
                .iter()
                .position(|group| group.len() > 1 && group.contains(&tag))
                .ok_or(MapError::Origin { tag })?,
        };
        Ok((groups.remove(index), groups))
    }

    fn groups(&self) -> Vec<Vec<TagId>> {
        let mut groups: Vec<Vec<TagId>> = Vec::new();
        for tag in self.neighbours.keys() {
            if !groups.iter().any(|group| group.contains(tag)) {
                groups.push(self.distances(*tag).into_keys().collect());
            }
        }
        groups
    }

    /// Steps from a tag to all that can be reached.
    pub fn distances(&self, from: TagId) -> BTreeMap<TagId, usize> {
        let mut distances = BTreeMap::from([(from, 0)]);
        let mut next = VecDeque::from([(from, 0)]);
        while let Some((tag, steps)) = next.pop_front() {
            for neighbour in self.neighbours(tag) {
                if let std::collections::btree_map::Entry::Vacant(free) = distances.entry(neighbour) {
                    free.insert(steps + 1);
                    next.push_back((neighbour, steps + 1));
                }
            }
        }
        distances
    }

    /// The longest loop among `group` that has no short cut: on it no two tags are nearer to each other than along it. Empty if
    /// there is none, or so many that looking at all would take minutes.
    pub fn longest_loop(&self, group: &[TagId]) -> Vec<TagId> {
        let distances: BTreeMap<TagId, BTreeMap<TagId, usize>> =
            group.iter().map(|tag| (*tag, self.distances(*tag))).collect();
        let steps = |a: TagId, b: TagId| distances.get(&a).and_then(|of| of.get(&b)).copied();
        let mut longest: Vec<TagId> = Vec::new();
        let pairs: usize = group.iter().map(|tag| self.neighbours(*tag).count()).sum();
        if pairs.saturating_mul(group.len()) > MOST_LOOPS {
            return longest;
        }
        for &root in group {
            for &a in group {
                for b in self.neighbours(a).filter(|b| *b > a) {
                    let (Some(to_a), Some(to_b)) = (steps(root, a), steps(root, b)) else { continue };
                    if to_a + to_b < longest.len() || to_a.abs_diff(to_b) > 1 {
                        continue;
                    }
                    let cycle = self.cycle(root, a, b, &distances);
                    if cycle.len() > longest.len().max(2) && is_without_short_cut(&cycle, &steps) {
                        longest = cycle;
                    }
                }
            }
        }
        longest
    }

    /// From a to the root on a shortest way, and back to b; with a tag twice, if both ways share it.
    fn cycle(
        &self,
        root: TagId,
        a: TagId,
        b: TagId,
        distances: &BTreeMap<TagId, BTreeMap<TagId, usize>>,
    ) -> Vec<TagId> {
        let down = |from: TagId| {
            let mut way = vec![from];
            let mut at = from;
            while at != root {
                let to_root = |tag: &TagId| distances.get(&root).and_then(|of| of.get(tag)).copied();
                let here = to_root(&at);
                let Some(next) =
                    self.neighbours(at).find(|next| to_root(next).map(|steps| steps + 1) == here)
                else {
                    return way;
                };
                way.push(next);
                at = next;
            }
            way
        };
        let mut cycle = down(a);
        cycle.extend(down(b).into_iter().rev().skip(1));
        cycle
    }
}

/// Short cuts are found for tags that are there twice too: their distance is 0.
fn is_without_short_cut(cycle: &[TagId], steps: &dyn Fn(TagId, TagId) -> Option<usize>) -> bool {
    cycle.iter().enumerate().all(|(i, a)| {
        cycle.iter().enumerate().skip(i + 1).all(|(j, b)| {
            let along = (j - i).min(cycle.len() - (j - i));
            steps(*a, *b) == Some(along)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Family;
    use crate::detection::TagObservation;

    fn tag(id: u32) -> TagId {
        TagId { family: Family::Tag36h11, id }
    }

    fn view(ids: &[u32]) -> View {
        let seen = |id: &u32| TagObservation {
            tag: tag(*id),
            corners_px: Default::default(),
            covariance_px2: nalgebra::SMatrix::identity(),
        };
        View { number: 0, observations: ids.iter().map(seen).collect() }
    }

    #[test]
    fn the_longest_loop_goes_around_without_short_cuts() {
        // Twelve in a ring, neighbours and next neighbours seen together, and a spur: steps 2, 2, 1, 2, 2, 1, 2.
        let mut views: Vec<View> = (0..12).map(|i| view(&[i, (i + 1) % 12, (i + 2) % 12])).collect();
        views.push(view(&[3, 20]));
        let graph = Graph::new(&views);
        let (group, others) = graph.split(None, views.len()).unwrap();
        assert_eq!((group.len(), others.len()), (13, 0));
        assert_eq!(graph.longest_loop(&group).len(), 7);
        // All together: nothing but triangles.
        let graph = Graph::new(&[view(&[0, 1, 2, 3, 4])]);
        assert_eq!(graph.longest_loop(&graph.tags()).len(), 3);
        // A chain: none.
        let graph = Graph::new(&[view(&[0, 1]), view(&[1, 2])]);
        assert!(graph.longest_loop(&graph.tags()).is_empty());
    }

    #[test]
    fn groups_are_split() {
        let views = [view(&[7, 8]), view(&[1, 2, 3]), view(&[5])];
        let graph = Graph::new(&views);
        let (group, others) = graph.split(None, 3).unwrap();
        assert_eq!(group, [1, 2, 3].map(tag));
        assert_eq!(others, [vec![tag(7), tag(8)], vec![tag(5)]]);
        assert_eq!(graph.split(Some(tag(8)), 3).unwrap().0, [7, 8].map(tag));
        assert_eq!(graph.split(Some(tag(5)), 3), Err(MapError::Origin { tag: tag(5) }));
        assert_eq!(Graph::new(&[view(&[5])]).split(None, 1), Err(MapError::NoPairs { views: 1 }));
    }
}
