//! Data inside an HTML page: arrays as compressed binary data, everything else as JSON.

use std::io::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use serde::Serialize;

/// Position of an array among the page's [`Arrays`]. In the page, `arrays.get` returns the array.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct ArrayRef {
    /// Index of its first byte.
    at: usize,
    /// Number of its elements.
    len: usize,
    /// Type of its elements.
    kind: ElementType,
}

/// Type of the elements of an array.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum ElementType {
    F64,
    F32,
    U8,
}

/// Arrays of numbers in the page.
///
/// Bytes of equal significance are stored together: those of sign, exponent and leading digits hardly
/// change from one value of a signal to the next, and compress well.
#[derive(Debug, Default)]
pub struct Arrays {
    bytes: Vec<u8>,
}

impl Arrays {
    /// Adds 64-bit floats, for values that must keep all digits, such as times.
    pub fn f64(&mut self, values: &[f64]) -> ArrayRef {
        self.add(ElementType::F64, values.iter().map(|value| value.to_le_bytes()))
    }

    /// Adds 32-bit floats, whose 7 digits are enough for plots and cursors.
    #[expect(clippy::cast_possible_truncation, reason = "intended")]
    pub fn f32(&mut self, values: &[f64]) -> ArrayRef {
        self.add(ElementType::F32, values.iter().map(|&value| (value as f32).to_le_bytes()))
    }

    /// Adds bytes, for shades of a picture.
    pub fn u8(&mut self, values: &[u8]) -> ArrayRef {
        self.add(ElementType::U8, values.iter().map(|&value| [value]))
    }

    fn add<const N: usize>(
        &mut self,
        kind: ElementType,
        values: impl ExactSizeIterator<Item = [u8; N]> + Clone,
    ) -> ArrayRef {
        let it = ArrayRef { at: self.bytes.len(), len: values.len(), kind };
        for place in 0..N {
            self.bytes.extend(values.clone().map(|bytes| bytes[place]));
        }
        it
    }

    /// The values of a reference to floats in the data of the page.
    #[cfg(test)]
    pub(crate) fn read(&self, reference: &serde_json::Value) -> Vec<f64> {
        let number = |key: &str| usize::try_from(reference[key].as_u64().unwrap()).unwrap();
        let (at, len) = (number("at"), number("len"));
        let byte = |k: usize, place: usize| self.bytes[at + place * len + k];
        let value = |k: usize| match reference["kind"].as_str() {
            Some("f32") => f32::from_le_bytes(std::array::from_fn(|i| byte(k, i))).into(),
            kind => {
                assert_eq!(kind, Some("f64"));
                f64::from_le_bytes(std::array::from_fn(|i| byte(k, i)))
            }
        };
        (0..len).map(value).collect()
    }

    /// All arrays as a zlib stream in base64.
    #[must_use]
    pub fn pack(&self) -> String {
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(6));
        // writing to memory cannot fail
        let packed = encoder.write_all(&self.bytes).and_then(|()| encoder.finish());
        STANDARD.encode(packed.unwrap_or_default())
    }
}

/// JSON that is safe in a `<script>` element: no text in it can end the element or begin a comment.
///
/// # Errors
/// The value has no JSON form.
pub fn script_json(value: &impl Serialize) -> serde_json::Result<String> {
    let text = serde_json::to_string(value)?;
    // JSON has these characters in strings only, where the escapes are valid
    Ok(text
        .replace('<', "\\u003c")
        .replace('>', "\\u003e")
        .replace('&', "\\u0026")
        .replace('\u{2028}', "\\u2028")
        .replace('\u{2029}', "\\u2029"))
}

/// Escapes a text for HTML, also in quoted attributes.
#[must_use]
pub fn html(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
        .replace('\'', "&#39;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read as _;

    #[test]
    fn invariant_arrays_come_back_bit_for_bit() {
        let mut arrays = Arrays::default();
        let values = [0.0, -1.5, 1e-300, f64::NAN, f64::INFINITY];
        let first = arrays.u8(&[7, 8, 9]);
        let second = arrays.f64(&values);
        let packed = STANDARD.decode(arrays.pack()).unwrap();
        let mut bytes = Vec::new();
        flate2::read::ZlibDecoder::new(packed.as_slice()).read_to_end(&mut bytes).unwrap();
        assert_eq!(bytes[first.at..first.at + first.len], [7, 8, 9]);
        for (k, value) in values.iter().enumerate() {
            let byte = |place: usize| bytes[second.at + place * second.len + k];
            let read = f64::from_le_bytes(std::array::from_fn(byte));
            assert_eq!(read.to_bits(), value.to_bits());
        }
    }

    #[test]
    fn issue_hostile_texts_stay_texts() {
        let hostile = "</script><!--<img src=x onerror='alert(1)'>\u{2028}&amp;\"";
        let json = script_json(&hostile).unwrap();
        assert!(!json.contains(['<', '>', '&', '\u{2028}']), "{json}");
        assert_eq!(serde_json::from_str::<String>(&json).unwrap(), hostile);
        let text = html(hostile);
        assert!(!text.contains(['<', '>', '"', '\'']), "{text}");
    }
}
