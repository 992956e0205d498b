// The filter's small language: words and comparisons, all of which have to hold.
//   plane        the word is somewhere in type, boundary, status, verdict or flags
//   -plane       it is not
//   chi2/dof>2   a number of the patch compared; the name may be shortened, "_" or
//                nothing may stand for blanks

const kComparison = /^([a-z0-9_/]+)(<=|>=|<|>|=)(-?[0-9.]+(?:e-?[0-9]+)?)$/i;

const kCompare = {
  '<': (a, b) => a < b,
  '>': (a, b) => a > b,
  '<=': (a, b) => a <= b,
  '>=': (a, b) => a >= b,
  '=': (a, b) => a === b,
};

const plain = (name) => name.toLowerCase().replace(/[\s_/]/g, '');

// As it is written, else without blanks, else by how it begins.
function findMeasure(measures, name) {
  const wanted = plain(name);
  const tests = [
    (x) => x.toLowerCase() === name,
    (x) => plain(x) === wanted,
    (x) => plain(x).startsWith(wanted),
  ];
  for (const test of tests) {
    const found = measures.find((m) => test(m.label) || test(m.name));
    if (found) return found;
  }
  return undefined;
}

function comparison(parts, measures) {
  const [, name, operator, number] = parts;
  const measure = findMeasure(measures, name);
  if (!measure) return { error: `no patch has a number called ${name}` };
  const limit = Number(number);
  if (!Number.isFinite(limit)) return { error: `${number} is no number` };
  return { test: (i) => kCompare[operator](measure.value(i), limit) };
}

// What stands in the words of a patch.
export function wordsOf(result, i) {
  const { surface, boundary } = result.typeOf(i);
  return [`#${i}`, surface, boundary, ...result.wordsOf(i)].join(' ').replaceAll('_', ' ').toLowerCase();
}

// { test(i), error }: error is empty or says what is not understood.
export function parseFilter(text, result, measures) {
  const tests = [];
  for (const token of text.trim().toLowerCase().replace(/\s*([<>]=?|=)\s*/g, '$1').split(/\s+/)) {
    const parts = kComparison.exec(token);
    if (parts) {
      const { test, error } = comparison(parts, measures);
      if (error) return { test: () => true, error };
      tests.push(test);
    } else if (token.startsWith('-') && token.length > 1) {
      const word = token.slice(1).replaceAll('_', ' ');
      tests.push((i) => !wordsOf(result, i).includes(word));
    } else if (token) {
      const word = token.replaceAll('_', ' ');
      tests.push((i) => wordsOf(result, i).includes(word));
    }
  }
  return { test: (i) => tests.every((test) => test(i)), error: '' };
}
