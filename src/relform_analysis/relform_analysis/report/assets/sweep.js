// The page of a sweep.

for (const table of document.querySelectorAll(".variants")) new VariantTable(table);
for (const section of document.querySelectorAll(".grid-plots")) new GridPlots(section);
for (const table of document.querySelectorAll(".strips")) {
  const strips = new Strips(table);
  const chooser = table.closest(".card").querySelector("select");
  chooser?.addEventListener("change", () => strips.show(chooser.value));
}
addEventListener("keydown", (event) => {
  if (event.key.toLowerCase() === "t" && !event.ctrlKey && !event.metaKey && !event.altKey) theme.toggle();
});
