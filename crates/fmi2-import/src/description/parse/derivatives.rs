//! The vendor annotation of fmi2-export: which derivatives an FMU accepts and provides.
//!
//! ```xml
//! <VendorAnnotations><Tool name="fmi2-export">
//!   <Derivatives inputs="3">
//!     <Inputs order="5" variables="1-3"/>
//!     <Outputs order="2" variables="7 9-16"/>
//!     <Interpolation order="2" variables="8"/>
//!   </Derivatives>
//! </Tool></VendorAnnotations>
//! ```
//!
//! `Inputs` accept derivatives up to that order instead of `inputs`, in the same call. `Interpolation` lists
//! outputs that have derivatives up to that order as well, which cost more than is worth for extrapolation.
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
    Some(Derivatives {
        inputs,
        outputs: orders(node, "Outputs", variables)?,
        interpolation: orders(node, "Interpolation", variables)?,
        further: orders(node, "Inputs", variables)?,
    })
}

/// The orders of the elements of a name, by index of the variable.
fn orders(node: Node<'_, '_>, name: &str, variables: usize) -> Option<HashMap<usize, usize>> {
    let mut orders = HashMap::new();
    for list in node.children().filter(|node| node.has_tag_name(name)) {
        let order: usize = list.attribute("order")?.parse().ok()?;
        for word in list.attribute("variables")?.split_ascii_whitespace() {
            let (first, last) = word.split_once('-').unwrap_or((word, word));
            let (first, last): (usize, usize) = (first.parse().ok()?, last.parse().ok()?);
            if first == 0 || last > variables {
                return None;
            }
            orders.extend((first..=last).map(|number| (number - 1, order)));
        }
    }
    Some(orders)
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
             <Outputs order='2' variables='9'/><Inputs order='5' variables='1'/>\
             <Interpolation order='2' variables='5-6'/></Derivatives>",
        );
        let read = read.unwrap();
        assert_eq!(read.inputs, 3);
        let expected = [(1, 1), (4, 1), (5, 1), (6, 1), (8, 2)];
        assert_eq!(read.outputs, HashMap::from(expected));
        assert_eq!(read.further, HashMap::from([(0, 5)]));
        assert_eq!(read.interpolation, HashMap::from([(4, 2), (5, 2)]));
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
