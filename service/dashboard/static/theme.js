// A classic script in the head: the choice has to hold before anything is painted.
{
  const remembered = (() => { try { return localStorage.getItem("meshcone.theme"); } catch { return null; } })();
  if (remembered) document.documentElement.dataset.theme = remembered;
  document.addEventListener("DOMContentLoaded", () => {
    document.getElementById("theme")?.addEventListener("click", () => {
      const root = document.documentElement;
      const dark = root.dataset.theme
        ? root.dataset.theme === "dark"
        : matchMedia("(prefers-color-scheme: dark)").matches;
      root.dataset.theme = dark ? "light" : "dark";
      try { localStorage.setItem("meshcone.theme", root.dataset.theme); } catch { /* a private window keeps nothing */ }
      dispatchEvent(new Event("themechange"));
    });
  });
}
