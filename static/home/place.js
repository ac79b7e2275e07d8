/** Where somebody was on the page when they left it, so that Back and a reload lead there. */

const KEPT = "snap6d.home";

/** Keeps how far the page was scrolled, and what `look()` tells, whenever it is left. */
export function keepPlace(look) {
  addEventListener("pagehide", () => {
    sessionStorage.setItem(KEPT, JSON.stringify({ address: location.href, top: scrollY, ...look() }));
  });
}

/** What was kept, if this is the same page again; null for somebody who came by a link. */
export function keptPlace() {
  const [{ type }] = /** @type {PerformanceNavigationTiming[]} */ (
    performance.getEntriesByType("navigation")
  );
  const kept = JSON.parse(sessionStorage.getItem(KEPT) ?? "null");
  return type !== "navigate" && kept?.address === location.href ? kept : null;
}
