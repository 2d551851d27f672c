//! Tables without lines and colours, which look the same in a pipe.

use comfy_table::presets::NOTHING;
use comfy_table::{CellAlignment, Table};

/// Rows as lines, with two spaces before every column. The columns in `numbers` are aligned right.
pub fn table(rows: impl IntoIterator<Item = Vec<String>>, numbers: &[usize]) -> String {
    let mut table = Table::new();
    table.load_style(NOTHING).add_rows(rows);
    for (k, column) in table.column_iter_mut().enumerate() {
        column.set_padding((2, 0));
        if numbers.contains(&k) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table.trim_fmt() + "\n"
}
