//! Where frames go that were tracked: table, JSON, pictures.

mod picture;

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use coshade_capture::Frame;
use coshade_lens::calibration::Calibration;
use image::RgbImage;

use super::Args;
use super::bodies::Bodies;
use super::rows::{self, FrameRow};
use crate::command::print;
use picture::Painter;

/// Prints and draws.
pub struct Output {
    format: Format,
    pictures: Option<Pictures>,
}

enum Format {
    Table,
    Lines,
    /// Kept for the object at the end.
    Object(Vec<FrameRow>),
}

struct Pictures {
    painter: Painter,
    path: PathBuf,
    /// The last frame, if only that is to be drawn.
    last: Option<Option<(Frame, FrameRow)>>,
}

impl Output {
    /// What the arguments say.
    ///
    /// # Errors
    /// A folder that cannot be made.
    pub fn new(args: &Args, calibration: &Calibration, bodies: &Bodies) -> anyhow::Result<Self> {
        let format = match (args.json, args.json_lines) {
            (true, _) => Format::Object(Vec::new()),
            (_, true) => Format::Lines,
            _ => Format::Table,
        };
        let pictures =
            args.output.as_deref().map(|path| Pictures::new(path, calibration, bodies)).transpose()?;
        if matches!(format, Format::Table) {
            print::text(rows::HEADING)?;
        }
        Ok(Self { format, pictures })
    }

    /// A frame.
    ///
    /// # Errors
    /// A picture or line that cannot be written.
    pub fn frame(&mut self, frame: &Frame, row: FrameRow) -> anyhow::Result<()> {
        if let Some(pictures) = &mut self.pictures {
            pictures.frame(frame, &row)?;
        }
        match &mut self.format {
            Format::Table => print::text(&row.lines()),
            Format::Lines => print::text(&(serde_json::to_string(&row)? + "\n")),
            Format::Object(rows) => {
                rows.push(row);
                Ok(())
            }
        }
    }

    /// Behind the last frame: the rows, if they are to be printed all at once.
    ///
    /// # Errors
    /// A picture that cannot be written.
    pub fn finish(self) -> anyhow::Result<Option<Vec<FrameRow>>> {
        if let Some(pictures) = self.pictures {
            pictures.finish()?;
        }
        Ok(match self.format {
            Format::Object(rows) => Some(rows),
            Format::Table | Format::Lines => None,
        })
    }
}

impl Pictures {
    fn new(path: &Path, calibration: &Calibration, bodies: &Bodies) -> anyhow::Result<Self> {
        let is_file =
            path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png")) && !path.is_dir();
        if !is_file {
            std::fs::create_dir_all(path).with_context(|| path.display().to_string())?;
        }
        let painter = Painter::new(calibration.clone(), bodies.list.clone())?;
        Ok(Self { painter, path: path.to_owned(), last: is_file.then_some(None) })
    }

    fn frame(&mut self, frame: &Frame, row: &FrameRow) -> anyhow::Result<()> {
        match &mut self.last {
            Some(last) => {
                *last = Some((frame.clone(), row.clone()));
                Ok(())
            }
            None => write(&self.path.join(format!("{:06}.png", row.frame)), &self.painter.paint(frame, row)?),
        }
    }

    fn finish(mut self) -> anyhow::Result<()> {
        match self.last.take().flatten() {
            Some((frame, row)) => write(&self.path, &self.painter.paint(&frame, &row)?),
            None => Ok(()),
        }
    }
}

fn write(path: &Path, picture: &RgbImage) -> anyhow::Result<()> {
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    Ok(coshade_image_file::write_png_rgb8(path, width, height, picture.as_raw())?)
}
