// Inputs of the page: its address, and robot files, which are read to the numbers of hopform.load_robot.

const number = (text) => {
  const plain = text.trim().replaceAll("_", "");
  const found = /^[+-]?inf$/.test(plain) ? (plain[0] === "-" ? -Infinity : Infinity) : Number(plain);
  return plain === "" ? NaN : found;
};

// A number as Python's repr writes it.
function repr(value) {
  if (!Number.isFinite(value)) return value > 0 ? "inf" : value < 0 ? "-inf" : "nan";
  const [digits, power] = value.toExponential().split("e");
  if (value !== 0 && (power < -4 || power > 15))
    return `${digits}e${power[0]}${power.slice(1).padStart(2, "0")}`;
  const plain = Object.is(value, -0) ? "-0" : String(value);
  return plain.includes(".") ? plain : `${plain}.0`;
}

// Call `write` at most once a second: at the first call, and once more after a second if others came. Safari throws at
// the 101st change of an address in 30 s; the next call writes again.
function onceASecond(write) {
  let waiting = false, again = false;
  const now = () => {
    [waiting, again] = [true, false];
    setTimeout(() => {
      waiting = false;
      if (again) now();
    }, 1000);
    try {
      write();
    } catch { /* the pictures must not wait for the address */ }
  };
  return () => {
    if (waiting) again = true;
    else now();
  };
}

// Whether a number lies in a domain, as in Python; excluded ends and infinity are outside.
function inside({ low, high, with_low, with_high }, value) {
  const [least, most] = [number(low), number(high)];
  const above = with_low ? value >= least : value > least, below = with_high ? value <= most : value < most;
  return above && below;
}

// Why parameters are refused, in the words of Python; "" if they are a robot that hops.
function refusalOf(parameters, { fields, domains }) {
  for (const { name, unit, domain } of fields) {
    const of = domains[domain], value = parameters[name], shown = unit === "1" ? "" : ` ${unit}`;
    if (!inside(of, value)) return `${name} must be ${of.allowed}${shown}, got ${repr(value)}`;
  }
  const { x1_min, x1_max, g } = parameters;
  if (x1_min > x1_max) return `x1_min must be <= x1_max m, got ${repr(x1_min)} > ${repr(x1_max)}`;
  return g > 0 ? "" : `hopping needs g > 0 m/s^2, got ${repr(g)}`;
}

// The warnings whose conditions the readings meet, from Python's table.
const HOLDS = { "<": (a, b) => a < b, "==": (a, b) => a === b, ">": (a, b) => a > b };

function warningsOf(table, readings) {
  const bound = (of) => ("reading" in of ? readings[of.reading] : number(of.number));
  const holds = ({ conditions }) => conditions.every(([name, by, of]) => HOLDS[by](readings[name], bound(of)));
  const shown = (_, name, form) =>
    (form === "!r" ? repr(readings[name]) : String(Number(readings[name].toPrecision(6))));
  return table.filter(holds).map(({ text }) => text.replace(/\{(\w+)(!r|:\.6g)\}/g, shown));
}

// The state in an address: words of their lists and finite numbers, else the values of `start`.
function stateOf(address, start, words) {
  const asked = new URLSearchParams(address), found = { ...start };
  for (const [key, otherwise] of Object.entries(start)) {
    if (!asked.has(key)) continue;
    const value = typeof otherwise === "number" ? Number(asked.get(key)) : asked.get(key);
    if (Object.hasOwn(words, key) ? words[key].includes(value) : Number.isFinite(value)) found[key] = value;
  }
  return found;
}

// ---- TOML 1.0 without dates, which no robot has ----

const LARGEST = 2 ** 20, MOST_DIGITS = 4300, DEEPEST = 64; // bytes of a file, as for load_robot; digits, as for Python
const ESCAPE = String.raw`\\(?:[btnfr"\\]|u[0-9A-Fa-f]{4}|U[0-9A-Fa-f]{8})`;
const IN_LINE = String.raw`[^\x00-\x08\x0a-\x1f\x7f`, IN_LINES = String.raw`[^\x00-\x08\x0b-\x1f\x7f`; // no controls
const TOKENS = Object.fromEntries(Object.entries({
  blank: "[ \\t]*",
  gap: `(?:[ \\t\\n]|#${IN_LINE}]*)*`,
  comment: `(?:#${IN_LINE}]*)?`,
  bare: "[A-Za-z0-9_-]+",
  lines: `"""\\n?((?:"{0,2}(?:${IN_LINES}"\\\\]|${ESCAPE}|\\\\[ \\t]*\\n[ \\t\\n]*))*"{0,2})"""(?!")`,
  line: `"((?:${IN_LINE}"\\\\]|${ESCAPE})*)"`,
  rawLines: `'''\\n?((?:'{0,2}${IN_LINES}'])*'{0,2})'''(?!')`,
  rawLine: `'(${IN_LINE}']*)'`,
  based: "0(?:x[0-9A-Fa-f](?:_?[0-9A-Fa-f])*|o[0-7](?:_?[0-7])*|b[01](?:_?[01])*)",
  decimal: "[+-]?(?:0|[1-9](?:_?[0-9])*)((?:\\.[0-9](?:_?[0-9])*)?(?:[eE][+-]?[0-9](?:_?[0-9])*)?)",
  special: "[+-]?(?:inf|nan)",
  truth: "true|false",
  any: "[^\\n]*",
}).map(([name, pattern]) => [name, new RegExp(pattern, "y")]));
const ESCAPED = { b: "\b", t: "\t", n: "\n", f: "\f", r: "\r" };

function unescaped(raw, fail) {
  return raw.replace(/\\(?:u(.{4})|U(.{8})|\s+|(.))/g, (_, four, eight, letter) => {
    const code = four ?? eight;
    if (code === undefined) return letter === undefined ? "" : ESCAPED[letter] ?? letter;
    const point = parseInt(code, 16);
    if (point > 0x10ffff || (point >= 0xd800 && point < 0xe000)) fail("not a Unicode character");
    return String.fromCodePoint(point);
  });
}

// The values of a text at its top level and in [fit], each with its line: Map of name to {value, line}.
function tablesOf(text) {
  const source = text.replaceAll("\r\n", "\n"), root = new Map();
  let at = 0, line = 1, counted = 0;
  const here = () => {
    for (; counted < at; counted++) if (source[counted] === "\n") line++;
    return line;
  };
  const fail = (message) => { throw new Error(`line ${here()}: ${message}`); };
  const take = (name) => {
    const token = TOKENS[name];
    token.lastIndex = at;
    const found = token.exec(source);
    if (found) at = token.lastIndex;
    return found;
  };
  const accept = (mark) => source.startsWith(mark, at) && (at += mark.length, true);

  function key() {
    const path = [];
    do {
      take("blank");
      const bare = take("bare"), quoted = bare ? null : take("line"), found = bare ?? quoted ?? take("rawLine");
      if (!found) fail(`expected name = number, got ${take("any")[0].trim()}`);
      path.push(bare ? bare[0] : quoted ? unescaped(quoted[1], fail) : found[1]);
      take("blank");
    } while (accept("."));
    return path;
  }

  function value(name, depth) {
    let found;
    if (depth > DEEPEST) fail(`${name} is nested too deep`);
    if ((found = take("lines") ?? take("line"))) return unescaped(found[1], fail);
    if ((found = take("rawLines") ?? take("rawLine"))) return found[1];
    if ((found = take("truth"))) return found[0] === "true";
    if (accept("[")) return list(name, depth);
    if (accept("{")) return inline(name, depth);
    if ((found = take("based"))) return whole(name, BigInt(found[0].replaceAll("_", "")));
    if ((found = take("decimal"))) {
      const plain = found[0].replaceAll("_", "");
      if (found[1]) return Number(plain);
      const digits = plain.replace(/^[+-]/, "");
      if (digits.length > MOST_DIGITS) fail(`${name} has more than ${MOST_DIGITS} digits`);
      return plain[0] === "-" ? whole(name, -BigInt(digits)) : whole(name, BigInt(digits));
    }
    if ((found = take("special"))) return found[0].endsWith("nan") ? NaN : number(found[0]);
    return fail(`${name} must be a number, got ${take("any")[0].trim()}`);
  }

  const whole = (name, large) => {
    const found = Number(large);
    return Number.isFinite(found) ? found : fail(`${name} is too large`);
  };

  function list(name, depth) {
    const found = [];
    for (take("gap"); !accept("]"); take("gap")) {
      found.push(value(name, depth + 1));
      take("gap");
      if (!accept(",")) return accept("]") ? found : fail(`${name}: expected ] after the list`);
    }
    return found;
  }

  function inline(name, depth) {
    const found = new Map();
    take("blank");
    if (accept("}")) return found;
    do pair(found, depth + 1); while (accept(","));
    return accept("}") ? found : fail(`${name}: expected } after the table`);
  }

  // One name and its value. Dotted names belong to the table fit, which then has no header of its own.
  function pair(table, depth) {
    const path = key(), [name] = path;
    if (!accept("=")) fail(`expected ${path.join(".")} = number`);
    take("blank");
    const begins = here(), found = value(path.join("."), depth);
    take("blank");
    let into = table;
    if (path.length > 1) {
      if (table !== root || name !== "fit" || path.length > 2) fail(`unknown parameter ${path.join(".")}`);
      if (!root.has("fit")) root.set("fit", { value: Object.assign(new Map(), { dotted: true }), line: begins });
      into = root.get("fit").value;
      if (!into.dotted) fail("duplicate table [fit]");
    }
    if (into.has(path.at(-1))) fail(`duplicate key ${path.join(".")}`);
    into.set(path.at(-1), { value: found, line: begins });
  }

  for (let table = root; at < source.length;) {
    take("blank");
    if (accept("\n")) continue;
    if (source[at] === "[") {
      at++;
      const path = key();
      if (!accept("]") || path.join(".") !== "fit" || path.length > 1) fail("unknown table, allowed is [fit]");
      if (root.has("fit")) fail("duplicate table [fit]");
      root.set("fit", { value: (table = new Map()), line: here() });
      take("blank");
    } else if (at < source.length && source[at] !== "#") pair(table, 0);
    take("comment");
    if (at < source.length && !accept("\n")) fail(`expected the end of the line, got ${take("any")[0].trim()}`);
  }
  return root;
}

// The parameters in the bytes of a robot's file. Domains are left to the library, the numbers in [fit] to Python.
function readRobot(bytes, facts) {
  const size = bytes.byteLength;
  if (size > LARGEST) throw new Error(`the file must have at most ${LARGEST} bytes, got ${size}`);
  let text;
  try {
    text = new TextDecoder("utf-8", { fatal: true }).decode(bytes);
  } catch {
    throw new Error("the file must be UTF-8 text");
  }
  const found = {}, fields = new Map(facts.fields.map((field) => [field.name, field.default]));
  for (const [name, { value, line }] of tablesOf(text)) {
    const fail = (message) => { throw new Error(`line ${line}: ${message}`); };
    if (name === "fit") {
      const has = value instanceof Map ? [...value.keys()].sort().join(", ") : "no table";
      if (has !== [...facts.fit].sort().join(", ")) fail(`[fit] must have ${facts.fit.join(", ")}, got ${has}`);
    } else if (facts.texts.includes(name)) {
      if (typeof value !== "string") fail(`${name} must be a text, got ${value}`);
    } else if (!fields.has(name)) fail(`unknown parameter ${name}`);
    else if (typeof value !== "number" || Number.isNaN(value)) fail(`${name} must be a number, got ${value}`);
    else found[name] = value;
  }
  for (const [name, otherwise] of fields) {
    if (!Object.hasOwn(found, name) && otherwise === null) throw new Error(`${name} is missing`);
    found[name] ??= number(otherwise);
  }
  return found;
}
