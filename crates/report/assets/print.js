// What paper shows: light colours, tables without scroll bars, no heading without content.

/** Whether a node shows anything on paper. */
function prints(node) {
  if (node.nodeType === Node.TEXT_NODE) return node.textContent.trim() !== "";
  if (node.nodeType !== Node.ELEMENT_NODE || node.matches(".picker, .hint, .choices, .screen, .hollow, button, input, select, details:not([open])")) return false;
  if (node.matches("canvas, svg, img, td")) return true;
  return [...node.childNodes].some(prints);
}

/** Hides headings that nothing follows on paper; shows all of them again on the screen. */
function hideHollow(printing) {
  // the lower headings first: one that is hidden is no content of a higher one
  for (const heading of [...main.querySelectorAll("h3"), ...main.querySelectorAll("h2")]) {
    heading.classList.remove("hollow");
    if (!printing) continue;
    let full = false;
    for (let it = heading.nextElementSibling; it && !full; it = it.nextElementSibling) {
      if (it.tagName <= heading.tagName && /^H\d$/.test(it.tagName)) break;
      full = prints(it);
    }
    heading.classList.toggle("hollow", !full);
  }
}

addEventListener("beforeprint", () => hideHollow(true));
addEventListener("afterprint", () => hideHollow(false));
matchMedia("print").addEventListener("change", (media) => hideHollow(media.matches));
