// What the page remembers about itself, in a cookie: the studio's port differs from run to run, and other storage of a
// browser belongs to a port.

const NAME = "rayfold-studio";
const YEAR = 31_536_000;

function all(): Record<string, string> {
  const text = document.cookie.split("; ").find((part) => part.startsWith(`${NAME}=`));
  return Object.fromEntries(new URLSearchParams(text?.slice(NAME.length + 1) ?? ""));
}

export function remembered(key: string, fallback: string): string {
  return all()[key] ?? fallback;
}

export function remember(key: string, value: string): void {
  document.cookie = `${NAME}=${new URLSearchParams({ ...all(), [key]: value })}; path=/; max-age=${YEAR}; samesite=strict`;
}
