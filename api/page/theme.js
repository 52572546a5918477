// Runs before anything is drawn, so that no page flashes white at night.
document.documentElement.dataset.theme =
  localStorage.getItem("waywright.theme") ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
