//! MAT files of version 5: a header, and one struct for each model ("MAT-File Format", The MathWorks).

use super::files::{Member, members};
use super::model::Model;

// data types
const INT8: u32 = 1;
const INT32: u32 = 5;
const UINT16: u32 = 4;
const UINT32: u32 = 6;
const DOUBLE: u32 = 9;
const MATRIX: u32 = 14;
// classes of arrays
const CELL: u32 = 1;
const STRUCT: u32 = 2;
const CHAR: u32 = 4;
const NUMBERS: u32 = 6;
/// Longest name of a variable.
const LONGEST: usize = 63;
/// Bytes of a field's name in a struct, with the zero at its end.
const FIELD: usize = 32;

/// The file with all models.
pub(crate) fn file(models: &[Model]) -> Vec<u8> {
    let mut file = b"MATLAB 5.0 MAT-file, state-space models of maglev linearize".to_vec();
    file.resize(116, b' ');
    // no subsystem data; version 1.0; the order of bytes
    file.extend([0; 8]);
    file.extend(0x0100_u16.to_le_bytes());
    file.extend(b"IM");
    let mut used = Vec::new();
    for model in models {
        let name = identifier(&model.name, &used);
        let mut fields = members(model);
        fields.push(("name", Member::Text(model.name.clone())));
        file.extend(structure(&name, &fields));
        used.push(name);
    }
    file
}

/// A name that MATLAB allows and that no other variable has.
fn identifier(name: &str, used: &[String]) -> String {
    let allowed = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let mut wanted: String = name.chars().map(allowed).collect();
    if !wanted.starts_with(|c: char| c.is_ascii_alphabetic()) {
        wanted.insert_str(0, "m_");
    }
    wanted.truncate(LONGEST);
    let mut unique = wanted.clone();
    let mut k = 2;
    while used.contains(&unique) {
        let end = format!("_{k}");
        unique = wanted[..wanted.len().min(LONGEST - end.len())].to_owned() + &end;
        k += 1;
    }
    unique
}

/// One element: tag, data, and zeros up to a multiple of 8 bytes.
fn element(kind: u32, data: &[u8]) -> Vec<u8> {
    let mut all = kind.to_le_bytes().to_vec();
    all.extend(u32::try_from(data.len()).unwrap_or(u32::MAX).to_le_bytes());
    all.extend(data);
    all.resize(all.len().next_multiple_of(8), 0);
    all
}

/// The beginning of an array: class, dimensions, name.
fn head(class: u32, rows: usize, columns: usize, name: &str) -> Vec<u8> {
    let words = |list: [usize; 2]| -> Vec<u8> {
        list.into_iter()
            .flat_map(|it| i32::try_from(it).unwrap_or(i32::MAX).to_le_bytes())
            .collect()
    };
    let mut all = element(UINT32, &[class.to_le_bytes(), [0; 4]].concat());
    all.extend(element(INT32, &words([rows, columns])));
    all.extend(element(INT8, name.as_bytes()));
    all
}

fn structure(name: &str, fields: &[(&'static str, Member)]) -> Vec<u8> {
    let mut data = head(STRUCT, 1, 1, name);
    // the length of names is a small element: its data is in its tag
    data.extend(((4 << 16) | INT32).to_le_bytes());
    data.extend((FIELD as u32).to_le_bytes());
    let mut names = Vec::new();
    for (field, _) in fields {
        let mut bytes = field.as_bytes().to_vec();
        bytes.resize(FIELD, 0);
        names.extend(bytes);
    }
    data.extend(element(INT8, &names));
    for (_, member) in fields {
        data.extend(array(member));
    }
    element(MATRIX, &data)
}

fn array(member: &Member) -> Vec<u8> {
    let data = match member {
        Member::Matrix(matrix) => {
            let mut data = head(NUMBERS, matrix.nrows(), matrix.ncols(), "");
            let numbers: Vec<u8> = matrix
                .col_iter()
                .flat_map(|column| column.iter().flat_map(|it| it.to_le_bytes()))
                .collect();
            data.extend(element(DOUBLE, &numbers));
            data
        }
        Member::Text(text) => {
            let units: Vec<u16> = text.encode_utf16().collect();
            let mut data = head(CHAR, 1, units.len(), "");
            let bytes: Vec<u8> = units.into_iter().flat_map(u16::to_le_bytes).collect();
            data.extend(element(UINT16, &bytes));
            data
        }
        Member::Texts(texts) => {
            let mut data = head(CELL, texts.len(), 1, "");
            texts.iter().for_each(|it| data.extend(array(&Member::Text(it.clone()))));
            data
        }
    };
    element(MATRIX, &data)
}
