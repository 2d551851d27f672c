//! The vendor annotation of fmi2-export: which derivatives an FMU accepts and provides.
//!
//! ```xml
//! <VendorAnnotations><Tool name="fmi2-export">
//!   <Derivatives inputs="3"><Outputs order="2" variables="7 9-16"/></Derivatives>
//! </Tool></VendorAnnotations>
//! ```
//!
//! Variables are counted from 1, as in ModelStructure. Annotations of other tools are ignored.

use std::collections::HashMap;

use roxmltree::Node;

use super::children;
use crate::description::Derivatives;

/// The exporter whose annotation this is.
const TOOL: &str = "fmi2-export";

/// Contents of the annotation; `None` if it is missing or invalid.
pub(super) fn derivatives(root: Node<'_, '_>, variables: usize) -> Option<Derivatives> {
    let tool = children(root, "VendorAnnotations", "Tool")
        .find(|tool| tool.attribute("name") == Some(TOOL))?;
    let node = tool.children().find(|node| node.has_tag_name("Derivatives"))?;
    let inputs = node.attribute("inputs")?.parse().ok()?;
    let mut outputs = HashMap::new();
    for list in node.children().filter(|node| node.has_tag_name("Outputs")) {
        let order: usize = list.attribute("order")?.parse().ok()?;
        for word in list.attribute("variables")?.split_ascii_whitespace() {
            let (first, last) = word.split_once('-').unwrap_or((word, word));
            let (first, last): (usize, usize) = (first.parse().ok()?, last.parse().ok()?);
            if first == 0 || last > variables {
                return None;
            }
            outputs.extend((first..=last).map(|number| (number - 1, order)));
        }
    }
    Some(Derivatives { inputs, outputs })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(tool: &str) -> Option<Derivatives> {
        let text = format!("<d><VendorAnnotations>{tool}</VendorAnnotations></d>");
        let document = roxmltree::Document::parse(&text).unwrap();
        derivatives(document.root_element(), 9)
    }

    fn ours(content: &str) -> Option<Derivatives> {
        read(&format!("<Tool name=\"other\"/><Tool name=\"fmi2-export\">{content}</Tool>"))
    }

    #[test]
    fn analytic_orders_are_read_by_variable() {
        let read = ours(
            "<Derivatives inputs='3'><Outputs order='1' variables='2 5-7'/>\
             <Outputs order='2' variables='9'/></Derivatives>",
        );
        let read = read.unwrap();
        assert_eq!(read.inputs, 3);
        let expected = [(1, 1), (4, 1), (5, 1), (6, 1), (8, 2)];
        assert_eq!(read.outputs, HashMap::from(expected));
    }

    #[test]
    fn issue_annotations_of_others_and_nonsense_count_for_nothing() {
        assert_eq!(read("<Tool name='other'><Derivatives inputs='3'/></Tool>"), None);
        for nonsense in [
            "<Other inputs='3'/>",
            "<Derivatives/>",
            "<Derivatives inputs='-1'/>",
            "<Derivatives inputs='3'><Outputs order='1' variables='0'/></Derivatives>",
            "<Derivatives inputs='3'><Outputs order='1' variables='8-10'/></Derivatives>",
            "<Derivatives inputs='3'><Outputs order='1' variables='x'/></Derivatives>",
            "<Derivatives inputs='3'><Outputs variables='1'/></Derivatives>",
        ] {
            assert_eq!(ours(nonsense), None, "{nonsense}");
        }
    }
}
