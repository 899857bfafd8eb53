//! Wavefront OBJ: polygons with normals and texture coordinates; `mtllib` beside it.
//!
//! Groups, objects and smoothing groups do not matter here. Lines, points and free-form surfaces are left out with a
//! warning. Read here rather than by a crate so that errors can name their line.

use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use glam::{Vec2, Vec3, Vec4};

use super::assemble::{Assembly, Piece};
use super::error::Fault;
use super::mtl::{self, Library};
use super::text::{Line, shortened};
use super::{ImportOptions, Imported, MAX_TRIANGLES, MAX_VERTICES, MissingNormals, Up};
use crate::normals;
use crate::polygon;
use crate::texture::srgb_to_linear;

/// Position, texture coordinate, normal: indices from 0.
type Corner = (u32, Option<u32>, Option<u32>);

/// Reads a file and its material libraries.
pub(super) fn read(folder: &Path, bytes: &[u8], options: &ImportOptions) -> Result<Imported, Fault> {
    let mut parser = Parser::default();
    for (number, text) in logical_lines(bytes) {
        parser.line(&Line { number, text: &text })?;
    }
    parser.finish(folder, options)
}

/// Lines with their first number, those ending in `\` joined with the next.
fn logical_lines(bytes: &[u8]) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut lines = bytes.split(|&byte| byte == b'\n').enumerate();
    std::iter::from_fn(move || {
        let (number, first) = lines.next()?;
        let mut text = decode(first);
        while let Some(head) = text.strip_suffix('\\') {
            let mut joined = head.to_owned();
            joined.push(' ');
            let Some((_, next)) = lines.next() else {
                text = joined.into();
                break;
            };
            joined.push_str(&decode(next));
            text = joined.into();
        }
        Some((number + 1, text))
    })
}

/// Names in old files are Latin-1 or worse; only numbers and keywords must be right.
fn decode(line: &[u8]) -> Cow<'_, str> {
    String::from_utf8_lossy(line.trim_ascii())
}

#[derive(Default)]
struct Parser {
    positions: Vec<Vec3>,
    colors: Vec<Vec4>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    /// Triangles for each material; `None` before any `usemtl`.
    runs: BTreeMap<usize, Vec<[Corner; 3]>>,
    names: Vec<Option<String>>,
    current: usize,
    triangles: usize,
    libraries: Vec<(usize, String)>,
    left_out: BTreeMap<String, (usize, usize)>,
}

impl Parser {
    fn line(&mut self, line: &Line<'_>) -> Result<(), Fault> {
        let text = line.text.split('#').next().unwrap_or_default();
        let mut words = text.split_ascii_whitespace();
        let Some(keyword) = words.next() else { return Ok(()) };
        let words: Vec<&str> = words.collect();
        let argument = || text.trim_ascii().strip_prefix(keyword).unwrap_or_default().trim_ascii().to_owned();
        match keyword {
            "v" => self.vertex(line, &words)?,
            "vt" => self.uvs.push(texture_coordinate(line, &words)?),
            "vn" => self.normals.push(Vec3::from_array(line.floats(&words)?)),
            "f" => self.face(line, &words)?,
            "usemtl" => self.use_material(argument()),
            "mtllib" => self.libraries.push((line.number, argument())),
            "o" | "g" | "s" | "mg" => {}
            _ => {
                let entry = self.left_out.entry(shortened(keyword)).or_insert((line.number, 0));
                entry.1 += 1;
            }
        }
        if self.positions.len().max(self.uvs.len()).max(self.normals.len()) > MAX_VERTICES {
            return Err(line.fault(format!("more than {MAX_VERTICES} vertices")));
        }
        Ok(())
    }

    fn vertex(&mut self, line: &Line<'_>, words: &[&str]) -> Result<(), Fault> {
        self.positions.push(Vec3::from_array(line.floats(words)?));
        // x y z r g b in sRGB, as MeshLab and Blender write it; a single fourth word is a weight, which polygons ignore.
        if words.len() >= 6 {
            let color = Vec3::from_array(line.floats(&words[3..])?).map(srgb_to_linear);
            self.colors.resize(self.positions.len() - 1, Vec4::ONE);
            self.colors.push(color.extend(1.0));
        }
        Ok(())
    }

    fn use_material(&mut self, name: String) {
        let name = Some(name);
        self.current = self.names.iter().position(|known| *known == name).unwrap_or_else(|| {
            self.names.push(name);
            self.names.len() - 1
        });
    }

    fn face(&mut self, line: &Line<'_>, words: &[&str]) -> Result<(), Fault> {
        if words.len() < 3 {
            return Err(line.fault(format!("a face of {} corners", words.len())));
        }
        let corners = words.iter().map(|word| self.corner(line, word)).collect::<Result<Vec<_>, _>>()?;
        self.triangles += corners.len() - 2;
        if self.triangles > MAX_TRIANGLES {
            return Err(line.fault(format!("more than {MAX_TRIANGLES} triangles")));
        }
        if self.names.is_empty() {
            self.names.push(None);
        }
        let outline: Vec<Vec3> = corners.iter().map(|corner| self.positions[corner.0 as usize]).collect();
        let run = self.runs.entry(self.current).or_default();
        run.extend(polygon::triangulate(&outline).into_iter().map(|corner| corner.map(|i| corners[i])));
        Ok(())
    }

    /// `v`, `v/vt`, `v//vn` or `v/vt/vn`; negative numbers count back from the last.
    fn corner(&self, line: &Line<'_>, word: &str) -> Result<Corner, Fault> {
        let mut parts = word.split('/');
        let mut index = |what: &str, count: usize| match parts.next() {
            None | Some("") => Ok(None),
            Some(text) => resolve(text, count)
                .map(Some)
                .ok_or_else(|| line.fault(format!("'{}' is no {what}, there are {count}", shortened(text)))),
        };
        let position = index("vertex (v)", self.positions.len())?;
        let uv = index("texture coordinate (vt)", self.uvs.len())?;
        let normal = index("normal (vn)", self.normals.len())?;
        let position = position.ok_or_else(|| line.fault(format!("'{}' has no vertex", shortened(word))))?;
        Ok((position, uv, normal))
    }

    fn finish(mut self, folder: &Path, options: &ImportOptions) -> Result<Imported, Fault> {
        let mut assembly = Assembly::default();
        for (keyword, (first, count)) in &self.left_out {
            assembly.warnings.push(format!("line {first}: '{keyword}' ({count} lines) is left out"));
        }
        let broken = self.normals.iter().filter(|normal| normal.try_normalize().is_none()).count();
        if broken > 0 {
            assembly
                .warnings
                .push(format!("{broken} normals (vn) are zero or not finite, the faces' own instead"));
        }
        if !self.colors.is_empty() {
            self.colors.resize(self.positions.len(), Vec4::ONE);
        }
        self.positions.iter_mut().for_each(|point| *point = turned(*point, options.up) * options.unit_m);
        self.normals.iter_mut().for_each(|normal| *normal = turned(*normal, options.up));
        let library = self.library(folder, &mut assembly)?;
        let smooth = self.smooth_normals(options);
        for (&run, triangles) in &self.runs {
            let name = self.names.get(run).cloned().flatten();
            let material = library.take(name.as_deref(), &mut assembly.warnings);
            let slot = assembly.material(material);
            let place = name.map_or_else(|| "faces".to_owned(), |name| format!("faces of material '{name}'"));
            assembly.add(self.piece(triangles, smooth.as_deref()), slot, &place)?;
        }
        assembly.finish(library.images())
    }

    fn library(&self, folder: &Path, assembly: &mut Assembly) -> Result<Library, Fault> {
        let mut library = Library::default();
        for (line, names) in &self.libraries {
            mtl::read_into(&mut library, folder, names, &format!("line {line}"), &mut assembly.warnings)?;
        }
        Ok(library)
    }

    /// One for each position, if some corner has none of its own and is to be smooth.
    fn smooth_normals(&self, options: &ImportOptions) -> Option<Vec<Vec3>> {
        let corners = || self.runs.values().flatten();
        let lacking = corners().flatten().any(|corner| corner.2.is_none());
        if !lacking || options.missing_normals == MissingNormals::Flat {
            return None;
        }
        let indices: Vec<u32> = corners().flatten().map(|corner| corner.0).collect();
        Some(normals::smooth(&self.positions, &indices))
    }

    fn piece(&self, triangles: &[[Corner; 3]], smooth: Option<&[Vec3]>) -> Piece {
        let mut piece = Piece::default();
        let mut numbers: HashMap<(Corner, u32), u32> = HashMap::new();
        let textured = triangles.iter().flatten().any(|corner| corner.1.is_some());
        for (number, triangle) in triangles.iter().enumerate() {
            let [a, b, c] = triangle.map(|corner| self.positions[corner.0 as usize]);
            let own = normals::flat(a, b, c);
            for corner in triangle {
                let given = corner.2.and_then(|normal| self.normals[normal as usize].try_normalize());
                let shared = given.or(smooth.map(|smooth| smooth[corner.0 as usize]));
                // Corners that are flat belong to their triangle only.
                let key = (*corner, if shared.is_some() { u32::MAX } else { number as u32 });
                let index = *numbers.entry(key).or_insert_with(|| {
                    piece.positions.push(self.positions[corner.0 as usize]);
                    piece.normals.push(shared.unwrap_or(own));
                    if textured {
                        // (0, 0) is the lower left corner in OBJ, the upper left here.
                        let uv = corner.1.map_or(Vec2::ZERO, |uv| self.uvs[uv as usize]);
                        piece.uvs.push(Vec2::new(uv.x, 1.0 - uv.y));
                    }
                    if !self.colors.is_empty() {
                        piece.colors.push(self.colors[corner.0 as usize]);
                    }
                    piece.positions.len() as u32 - 1
                });
                piece.indices.push(index);
            }
        }
        piece
    }
}

fn texture_coordinate(line: &Line<'_>, words: &[&str]) -> Result<Vec2, Fault> {
    if let [u] = words {
        return Ok(Vec2::new(line.float(u)?, 0.0));
    }
    Ok(Vec2::from_array(line.floats(words)?))
}

fn resolve(text: &str, count: usize) -> Option<u32> {
    let index: i64 = text.parse().ok()?;
    let count = i64::try_from(count).ok()?;
    let from_zero = if index > 0 { index - 1 } else { count.checked_add(index)? };
    let known = index != 0 && (0..count).contains(&from_zero);
    known.then(|| u32::try_from(from_zero).ok()).flatten()
}

/// A file's vector in our axes.
pub(super) fn turned(vector: Vec3, up: Up) -> Vec3 {
    match up {
        Up::Z => vector,
        Up::Y => Vec3::new(vector.x, -vector.z, vector.y),
    }
}
