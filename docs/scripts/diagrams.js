// Draws the diagrams of a page: each block of Mermaid's language becomes an image. A click shows it in its own size.
document.addEventListener("DOMContentLoaded", async () => {
  for (const block of document.querySelectorAll(".highlight-mermaid")) {
    const diagram = document.createElement("pre");
    diagram.className = "mermaid";
    diagram.title = "click to enlarge";
    diagram.textContent = block.querySelector("pre").textContent;
    diagram.addEventListener("click", () => {
      const image = diagram.querySelector("svg");
      const fits = image.style.maxWidth !== "none";
      image.style.maxWidth = fits ? "none" : "100%";
      image.style.width = fits ? `${image.viewBox.baseVal.width}px` : "100%";
    });
    block.replaceWith(diagram);
  }
  const dark = matchMedia("(prefers-color-scheme: dark)").matches;
  mermaid.initialize({ startOnLoad: false, theme: dark ? "dark" : "neutral" });
  await mermaid.run();
});
