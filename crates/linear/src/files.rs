//! Models as files: JSON, MAT (version 5, for MATLAB, Octave and scipy) and NPZ (for numpy).
//!
//! MAT files hold one struct per model, NPZ files one array per member, such as `coupled.A`. Both formats are short and
//! fixed; the crates for them read only, or bring a parser of Python with them.

use std::io::{Cursor, Write as _};

use faer::Mat;
use serde_json::{Value, json};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use super::coupled::StateSpace;
use super::mat5;
use super::model::{Model, Models, measures, names};

/// A member of a model.
pub(crate) enum Member {
    Matrix(Mat<f64>),
    Texts(Vec<String>),
    Text(String),
}

/// Members of a model in the order of the files.
pub(crate) fn members(model: &Model) -> Vec<(&'static str, Member)> {
    let StateSpace { states, inputs, outputs, a, b, c, d } = &model.system;
    let mut all = vec![
        ("A", Member::Matrix(a.clone())),
        ("B", Member::Matrix(b.clone())),
        ("C", Member::Matrix(c.clone())),
        ("D", Member::Matrix(d.clone())),
        ("states", Member::Texts(states.clone())),
        ("inputs", Member::Texts(names(inputs))),
        ("input_units", Member::Texts(measures(inputs))),
        ("outputs", Member::Texts(names(outputs))),
        ("output_units", Member::Texts(measures(outputs))),
        ("source", Member::Text(model.source.as_str().to_owned())),
        // 0 for a differential equation, as in control systems software
        ("step", Member::Matrix(Mat::from_fn(1, 1, |_, _| model.step.unwrap_or(0.0)))),
    ];
    if let Some(error) = model.error {
        all.push(("error", Member::Matrix(Mat::from_fn(1, 1, |_, _| error))));
    }
    all
}

impl Models {
    /// As JSON.
    #[must_use]
    pub fn to_json(&self) -> Value {
        let model = |it: &Model| {
            let mut object = json!({"name": it.name, "step": it.step});
            for (name, member) in members(it) {
                object[name] = match member {
                    Member::Matrix(matrix) if ["A", "B", "C", "D"].contains(&name) => rows(&matrix),
                    Member::Matrix(_) if name == "step" => continue,
                    Member::Matrix(matrix) => json!(matrix[(0, 0)]),
                    Member::Texts(texts) => json!(texts),
                    Member::Text(text) => json!(text),
                };
            }
            object
        };
        json!({
            "operating_point": self.point,
            "notes": self.notes,
            "models": self.models.iter().map(model).collect::<Vec<_>>(),
        })
    }

    /// As a MAT file of version 5.
    #[must_use]
    pub fn to_mat(&self) -> Vec<u8> {
        mat5::file(&self.models)
    }

    /// As an NPZ file.
    ///
    /// # Errors
    /// The archive cannot be made.
    pub fn to_npz(&self) -> std::io::Result<Vec<u8>> {
        let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
        for model in &self.models {
            for (name, member) in members(model) {
                let file = format!("{}.{name}.npy", model.name);
                archive.start_file(file, SimpleFileOptions::default())?;
                archive.write_all(&npy(&member))?;
            }
        }
        Ok(archive.finish()?.into_inner())
    }
}

fn rows(matrix: &Mat<f64>) -> Value {
    let row = |i| Value::from((0..matrix.ncols()).map(|j| matrix[(i, j)]).collect::<Vec<f64>>());
    (0..matrix.nrows()).map(row).collect()
}

/// One array in the NPY format, version 1.0: column-major numbers, or texts of UTF-32 of equal length.
fn npy(member: &Member) -> Vec<u8> {
    let (kind, shape, data) = match member {
        Member::Matrix(matrix) => {
            let shape = format!("({}, {})", matrix.nrows(), matrix.ncols());
            let mut data = Vec::with_capacity(8 * matrix.nrows() * matrix.ncols());
            for column in matrix.col_iter() {
                column.iter().for_each(|value| data.extend(value.to_le_bytes()));
            }
            ("<f8".to_owned(), shape, data)
        }
        Member::Texts(texts) => {
            let (kind, data) = utf32(texts);
            (kind, format!("({},)", texts.len()), data)
        }
        Member::Text(text) => {
            let (kind, data) = utf32(std::slice::from_ref(text));
            (kind, "()".to_owned(), data)
        }
    };
    let mut header =
        format!("{{'descr': '{kind}', 'fortran_order': True, 'shape': {shape}, }}").into_bytes();
    // magic, version, length and header fill a multiple of 64 bytes
    let start = 10;
    header.resize((start + header.len() + 1).next_multiple_of(64) - start - 1, b' ');
    header.push(b'\n');
    let mut file = b"\x93NUMPY\x01\x00".to_vec();
    file.extend(u16::try_from(header.len()).unwrap_or(u16::MAX).to_le_bytes());
    file.extend(header);
    file.extend(data);
    file
}

fn utf32(texts: &[String]) -> (String, Vec<u8>) {
    let width = texts.iter().map(|it| it.chars().count()).max().unwrap_or(0).max(1);
    let mut data = Vec::new();
    for text in texts {
        let mut letters = text.chars();
        for _ in 0..width {
            data.extend(letters.next().map_or(0, u32::from).to_le_bytes());
        }
    }
    (format!("<U{width}"), data)
}
