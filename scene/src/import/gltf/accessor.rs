//! Numbers in buffers.

use ::gltf::Document;
use ::gltf::json::accessor::{Accessor, ComponentType, Type, sparse};
use ::gltf::json::validation::Checked;

use super::super::MAX_VERTICES;
use super::Fault;
use super::buffers::Buffers;

/// Most elements of an accessor that has no bytes behind it (sparse, without a view): the only count a small file
/// could make large.
const MAX_UNBACKED: usize = 1 << 20;

/// A checked accessor.
pub(super) struct Reader<'a> {
    place: String,
    count: usize,
    components: usize,
    component: ComponentType,
    normalized: bool,
    /// First byte of element 0 and the step; `None`: all zero.
    base: Option<(&'a [u8], usize)>,
    sparse: Vec<(usize, &'a [u8])>,
}

impl<'a> Reader<'a> {
    /// Checks that all elements lie within their buffers.
    pub fn new(document: &'a Document, buffers: &'a Buffers<'a>, number: usize) -> Result<Self, Fault> {
        let place = format!("accessors[{number}]");
        let fault = |problem: String| Fault::new(place.clone(), problem);
        let accessor =
            document.as_json().accessors.get(number).ok_or_else(|| fault("does not exist".to_owned()))?;
        let (component, components) =
            element_type(accessor).ok_or_else(|| fault("unknown type".to_owned()))?;
        let count = usize::try_from(accessor.count.0).unwrap_or(usize::MAX);
        let most = if accessor.buffer_view.is_some() { 3 * MAX_VERTICES } else { MAX_UNBACKED };
        if count == 0 || count > most {
            return Err(fault(format!("count is {count}, expected 1 to {most}")));
        }
        let size = components * component.size();
        let base = match accessor.buffer_view {
            None => None,
            Some(view) => {
                let offset = accessor.byte_offset.unwrap_or_default().0;
                Some(elements(buffers, view.value(), offset, count, size, &place)?)
            }
        };
        let sparse = match &accessor.sparse {
            None => Vec::new(),
            Some(sparse) => sparse_elements(buffers, sparse, count, size, &place)?,
        };
        Ok(Self { place, count, components, component, normalized: accessor.normalized, base, sparse })
    }

    /// Number of elements.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Elements of `N` numbers; integers become [0, 1] or [−1, 1] if the accessor says they are normalised.
    pub fn floats<const N: usize>(&self) -> Result<Vec<[f32; N]>, Fault> {
        self.expect_components(N, N)?;
        Ok(self.elements(|bytes| self.float_element(bytes)))
    }

    /// Colours with or without alpha.
    pub fn colors(&self) -> Result<Vec<[f32; 4]>, Fault> {
        self.expect_components(3, 4)?;
        Ok(self.elements(|bytes| {
            let mut color: [f32; 4] = self.float_element(bytes);
            if self.components == 3 {
                color[3] = 1.0;
            }
            color
        }))
    }

    /// Indices of 8, 16 or 32 bits.
    pub fn indices(&self) -> Result<Vec<u32>, Fault> {
        self.expect_components(1, 1)?;
        if !matches!(self.component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32) {
            return Err(Fault::new(&self.place, "indices must be unsigned integers"));
        }
        Ok(self.elements(|bytes| unsigned(bytes, self.component)))
    }

    fn expect_components(&self, least: usize, most: usize) -> Result<(), Fault> {
        if (least..=most).contains(&self.components) {
            return Ok(());
        }
        let problem = format!("elements of {} numbers, expected {most}", self.components);
        Err(Fault::new(&self.place, problem))
    }

    fn elements<T: Clone>(&self, decode: impl Fn(&[u8]) -> T) -> Vec<T> {
        let size = self.components * self.component.size();
        let mut elements = match self.base {
            None => vec![decode(&[0; 64][..size]); self.count],
            Some((bytes, stride)) => {
                (0..self.count).map(|i| decode(&bytes[i * stride..i * stride + size])).collect()
            }
        };
        for (at, bytes) in &self.sparse {
            elements[*at] = decode(bytes);
        }
        elements
    }

    /// Missing components stay 0.
    fn float_element<const N: usize>(&self, bytes: &[u8]) -> [f32; N] {
        let mut element = [0.0; N];
        for (number, bytes) in element.iter_mut().zip(bytes.chunks_exact(self.component.size())) {
            *number = float(bytes, self.component, self.normalized);
        }
        element
    }
}

fn element_type(accessor: &Accessor) -> Option<(ComponentType, usize)> {
    let (Checked::Valid(component), Checked::Valid(kind)) = (accessor.component_type, accessor.type_) else {
        return None;
    };
    let components = match kind {
        Type::Scalar => 1,
        Type::Vec2 => 2,
        Type::Vec3 => 3,
        Type::Vec4 | Type::Mat2 => 4,
        Type::Mat3 => 9,
        Type::Mat4 => 16,
    };
    Some((component.0, components))
}

/// Bytes from element 0 on and the step to the next.
fn elements<'a>(
    buffers: &'a Buffers<'a>,
    view: usize,
    offset: u64,
    count: usize,
    size: usize,
    place: &str,
) -> Result<(&'a [u8], usize), Fault> {
    let (bytes, stride) = buffers.view(view)?;
    let stride = stride.unwrap_or(size);
    if stride < size {
        let problem = format!("elements of {size} bytes, but bufferViews[{view}] has a stride of {stride}");
        return Err(Fault::new(place, problem));
    }
    let start = usize::try_from(offset).unwrap_or(usize::MAX);
    let needed = (count - 1).checked_mul(stride).and_then(|bytes| bytes.checked_add(size));
    let end = needed.and_then(|needed| start.checked_add(needed));
    match end.and_then(|end| bytes.get(start..end)) {
        Some(bytes) => Ok((bytes, stride)),
        None => {
            let length = bytes.len();
            let problem = format!(
                "{count} elements of {size} bytes, {stride} apart, from byte {offset} on: bufferViews[{view}] has only {length}"
            );
            Err(Fault::new(place, problem))
        }
    }
}

fn sparse_elements<'a>(
    buffers: &'a Buffers<'a>,
    sparse: &sparse::Sparse,
    count: usize,
    size: usize,
    place: &str,
) -> Result<Vec<(usize, &'a [u8])>, Fault> {
    let place = format!("{place}.sparse");
    let some = usize::try_from(sparse.count.0).unwrap_or(usize::MAX);
    if some == 0 || some > count {
        return Err(Fault::new(place, format!("count is {some}, expected 1 to {count}")));
    }
    let Checked::Valid(component) = sparse.indices.component_type else {
        return Err(Fault::new(place, "unknown type of indices"));
    };
    let (indices, values) = (&sparse.indices, &sparse.values);
    let index_size = component.0.size();
    let (index_bytes, index_stride) =
        elements(buffers, indices.buffer_view.value(), indices.byte_offset.0, some, index_size, &place)?;
    let (value_bytes, value_stride) =
        elements(buffers, values.buffer_view.value(), values.byte_offset.0, some, size, &place)?;
    let mut found = Vec::with_capacity(some);
    for i in 0..some {
        let at = unsigned(&index_bytes[i * index_stride..][..index_size], component.0) as usize;
        if at >= count {
            return Err(Fault::new(place, format!("index {at}, but there are only {count} elements")));
        }
        found.push((at, &value_bytes[i * value_stride..][..size]));
    }
    Ok(found)
}

fn unsigned(bytes: &[u8], component: ComponentType) -> u32 {
    match (component, bytes) {
        (ComponentType::U8, &[a]) => u32::from(a),
        (ComponentType::U16, &[a, b]) => u32::from(u16::from_le_bytes([a, b])),
        (_, &[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]),
        _ => u32::MAX,
    }
}

/// glTF 2.0, section 3.11: normalised integers become `max(c/127, −1)` and the like.
fn float(bytes: &[u8], component: ComponentType, normalized: bool) -> f32 {
    let (value, largest) = match (component, bytes) {
        (ComponentType::I8, &[a]) => (f32::from(a as i8), 127.0),
        (ComponentType::U8, &[a]) => (f32::from(a), 255.0),
        (ComponentType::I16, &[a, b]) => (f32::from(i16::from_le_bytes([a, b])), 32767.0),
        (ComponentType::U16, &[a, b]) => (f32::from(u16::from_le_bytes([a, b])), 65535.0),
        (ComponentType::F32, &[a, b, c, d]) => return f32::from_le_bytes([a, b, c, d]),
        (_, &[a, b, c, d]) => (u32::from_le_bytes([a, b, c, d]) as f32, u32::MAX as f32),
        _ => (f32::NAN, 1.0),
    };
    if normalized { (value / largest).max(-1.0) } else { value }
}
