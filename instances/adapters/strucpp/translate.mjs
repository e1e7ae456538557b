// Calls the compiler STruC++ for `plcctl build application`: node translate.mjs FOLDER_OF_THE_COMPILER, in the
// folder for the files between. Reads order.json there: {"sources": [{"name", "text", "places": [{"line", "name",
// "location"}], "inserted": [{"line", "column", "length"}]}]}. A place is one that plcctl has taken out of the text, for
// the compiler lets no two variables have one. Inserted is what it has put in. Writes the C++ files and
// plan.json: what is wrong, else the program's tasks, POUs, types and variables, which plcctl checks and plans.
// Exit code 0: plan.json was written, also if the program has errors.
import { existsSync, readFileSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';

const kMostMessages = 100; // more are counted only
const kMostSymbols = 65536; // as plc_variables.h has it
const kMostBases = 32; // that a block extends, one above the other
const kMostElements = 1000; // of an array of function blocks, each with variables of its own

const folder = resolve(process.argv[2]);
const { sources } = JSON.parse(readFileSync('order.json', 'utf8'));
const { compile, discoverStlibs, StdFunctionRegistry } = await import(pathToFileURL(join(folder, 'dist', 'node', 'index.js')).href);

const fileNumbers = new Map(sources.map((source, i) => [source.name, i]));
const lines = sources.map((source) => source.text.split('\n'));

// Places that the text has no more, by file, line and name.
const places = new Map(
  sources.flatMap((source, number) => (source.places ?? []).map((one) => [`${number}:${one.line}:${one.name}`, { ...one, number }])),
);

function place(file, line, column) {
  return [fileNumbers.get(file) ?? -1, line > 0 ? line : 0, column > 0 ? column : 0];
}
function placeOf(node) {
  const span = node?.sourceSpan;
  return span === undefined ? [-1, 0, 0] : place(span.file, span.startLine, span.startCol);
}
function placeAt(number, offset) {
  const before = sources[number].text.slice(0, offset);
  return [number, before.split('\n').length, offset - before.lastIndexOf('\n')];
}

// Comments and texts become blanks: no other character moves.
function withoutTexts(text) {
  return text.replace(/\(\*[\s\S]*?\*\)|\/\*[\s\S]*?\*\/|\/\/[^\n]*|'(?:\$.|[^'$\n])*'/g, (part) => part.replace(/[^\n]/g, ' '));
}

// Where a comment begins that has no end.
function placeOfComment(file) {
  const searched = file === undefined ? [...sources.keys()] : [fileNumbers.get(file) ?? -1];
  for (const number of searched) {
    const at = withoutTexts(sources[number]?.text ?? '').search(/\(\*|\/\*/);
    if (at >= 0) return placeAt(number, at);
  }
  return undefined;
}

// Where a global is declared.
function placeOfGlobal(name) {
  for (const [number, { text }] of sources.entries()) {
    for (const section of withoutTexts(text).matchAll(/\bVAR_GLOBAL\b[\s\S]*?\bEND_VAR\b/gi)) {
      const at = section[0].search(new RegExp(`\\b${name}\\b`, 'i'));
      if (at >= 0) return placeAt(number, section.index + at);
    }
  }
  return undefined;
}

// Where a variable is declared that refers to an object with an interface: the compiler's table for debuggers breaks off there.
function placeOfInterface() {
  const texts = sources.map((source) => withoutTexts(source.text));
  const names = texts.flatMap((text) => Array.from(text.matchAll(/\bINTERFACE\s+(\w+)/gi), ([, name]) => name));
  const declaration = new RegExp(`\\w+(?=\\s*:\\s*(?:${names.join('|')})\\b)`, 'i');
  for (const [number, text] of names.length === 0 ? [] : texts.entries()) {
    for (const section of text.matchAll(/\bVAR\w*\b[\s\S]*?\bEND_VAR\b/gi)) {
      const at = section[0].search(declaration);
      if (at >= 0) return placeAt(number, section.index + at);
    }
  }
  return undefined;
}

// Some messages of the compiler have no line, and say in their text what they are about.
function explained(found) {
  const character = /^unexpected character: ->([\s\S]+)<- at offset: (\d+), skipped \d+ characters\.$/.exec(found.message);
  if (character !== null) {
    const number = fileNumbers.get(found.file ?? sources[0].name);
    const offset = Number(character[2]);
    // The compiler has names in upper case. An instruction list was rewritten before: the offset is then none of the source.
    const written = sources[number]?.text.slice(offset, offset + character[1].length) ?? '';
    if (written !== '' && written.toUpperCase() === character[1].toUpperCase()) return { place: placeAt(number, offset), text: `unexpected character '${written}'` };
  }
  const comment = found.message === 'Unclosed block comment' ? placeOfComment(found.file) : undefined;
  if (comment !== undefined) return { place: comment, text: 'this comment has no end' };
  const variable = found.message.endsWith("(reading 'definition')") ? placeOfInterface() : undefined;
  if (variable !== undefined) return { place: variable, text: 'STruC++ knows no variables of an interface' };
  const global = /^Shared global '(\w+)' /.exec(found.message);
  const place = global === null ? undefined : placeOfGlobal(global[1]);
  return place === undefined ? undefined : { place, text: found.message };
}

// Of some messages the compiler knows the line only: the last file that has one of its words there.
function fileOf({ message: text, line }) {
  const words = (text.match(/\w+/g) ?? []).filter((word) => word === word.toUpperCase());
  const has = (number) => words.some((word) => new RegExp(`\\b${word}\\b`, 'i').test(lines[number][line - 1] ?? ''));
  const number = sources.findLastIndex((source, i) => has(i));
  return sources[Math.max(number, 0)].name;
}

function message(found) {
  const known = found.line > 0 ? undefined : explained(found);
  const hint = found.suggestion === undefined ? '' : ` ${found.suggestion}`;
  // A message of several lines is told as one.
  const text = `${known?.text ?? found.message}${hint}`.replace(/[\0-\x1f\x7f]+/g, ' ').slice(0, 1000);
  return { place: known?.place ?? place(found.file ?? fileOf(found), found.line, found.column), text };
}

// A POU of the program and one of a library with the same name would both go into the C++. That of the program counts.
function libraries() {
  const own = new Set();
  for (const { text } of sources) {
    const plain = text.replace(/\(\*[\s\S]*?\*\)|\/\*[\s\S]*?\*\/|\/\/[^\n]*/g, ' ');
    for (const [, name] of plain.matchAll(/^\s*FUNCTION(?:_BLOCK)?\s+(?:ABSTRACT\s+|FINAL\s+)*(\w+)/gim)) own.add(name.toUpperCase());
  }
  const isOfLibrary = (one) => !own.has(one.name.toUpperCase());
  return discoverStlibs(join(folder, 'libs')).map((archive) => ({
    ...archive,
    chunks: archive.chunks?.filter(isOfLibrary),
    manifest: {
      ...archive.manifest,
      functions: archive.manifest.functions.filter(isOfLibrary),
      functionBlocks: archive.manifest.functionBlocks.filter(isOfLibrary),
    },
  }));
}

function translate() {
  const [first, ...others] = sources;
  try {
    return compile(first.text, {
      debug: true,
      lineMapping: true,
      lineDirectives: true,
      optimizationLevel: 0,
      fileName: first.name,
      additionalSources: others.map((other) => ({ source: other.text, fileName: other.name })),
      libraries: libraries(),
    });
  } catch (error) {
    // The compiler throws for what it does not support, without a place.
    return { success: false, errors: [{ message: String(error?.message ?? error), line: 0, column: 0 }], warnings: [] };
  }
}

// The compiler knows names in upper case only. As it stands in the source: behind its key word.
function nameAsWritten(node, words) {
  const [file, line, column] = placeOf(node);
  const text = file < 0 ? '' : lines[file].slice(line - 1, line + 3).join('\n').slice(column - 1);
  const found = new RegExp(`^\\s*(?:${words})\\s+(\\w+)`, 'i').exec(text);
  const name = node.name ?? node.instanceName;
  return found !== null && found[1].toUpperCase() === name.toUpperCase() ? found[1] : name;
}

// The names of a declaration: a, b AT %IX0.0 : BOOL.
function namesAsWritten(declaration) {
  const [file, line, column] = placeOf(declaration);
  const text = file < 0 ? '' : lines[file].slice(line - 1, line + 9).join('\n').slice(column - 1);
  const written = (/^([\w\s,]+?)\s*(?:\bAT\b|:)/i.exec(text)?.[1] ?? '').split(',').map((name) => name.trim());
  return declaration.names.map((name, i) => (written[i]?.toUpperCase() === name.toUpperCase() ? written[i] : name));
}

// All nodes below one, in any order.
function* nodesIn(root) {
  const open = [root];
  while (open.length > 0) {
    const node = open.pop();
    if (node === null || typeof node !== 'object') continue;
    if (typeof node.kind === 'string') yield node;
    const values = node instanceof Map ? node.values() : Object.entries(node).filter(([key]) => key !== 'parent' && key !== 'sourceSpan').map(([, value]) => value);
    for (const value of values) open.push(value);
  }
}

const kRanges = new Map(
  [8n, 16n, 32n, 64n].flatMap((bits, i) => [
    [['SINT', 'INT', 'DINT', 'LINT'][i], [-(1n << (bits - 1n)), (1n << (bits - 1n)) - 1n]],
    [['USINT', 'UINT', 'UDINT', 'ULINT'][i], [0n, (1n << bits) - 1n]],
  ]),
);

const kComparisons = new Set(['<', '>', '<=', '>=', '=', '<>']);

const kLongNames = new Map([
  ['DATE_AND_TIME', 'DT'],
  ['TIME_OF_DAY', 'TOD'],
  ['LDATE', 'DATE'],
  ['LTOD', 'TOD'],
  ['LTIME_OF_DAY', 'TOD'],
  ['LDT', 'DT'],
  ['LDATE_AND_TIME', 'DT'],
  ['LTIME', 'TIME'],
  ['WSTRING', 'STRING'],
]);

// Of a number; undefined: of another expression.
function integerOf(node) {
  if (node?.kind === 'UnaryExpression' && node.operator === '-') {
    const value = integerOf(node.operand);
    return value === undefined ? undefined : -value;
  }
  if (node?.kind === 'ParenthesizedExpression') return integerOf(node.expression);
  if (node?.kind !== 'LiteralExpression' || node.literalType !== 'INT') return undefined;
  const [, base, digits] = /^(?:[A-Z]+#)?(?:(16|8|2)#)?(\w+)$/i.exec(node.rawValue.replaceAll('_', '')) ?? [];
  if (digits === undefined) return undefined;
  const prefix = { 16: '0x', 8: '0o', 2: '0b' }[base] ?? '';
  try {
    return BigInt(`${prefix}${digits}`);
  } catch {
    return undefined;
  }
}

// The nanoseconds of T#1h2m3.5s, exactly; undefined: of another form.
function exactNanoseconds(text) {
  const units = { d: 86400n * 10n ** 9n, h: 3600n * 10n ** 9n, m: 60n * 10n ** 9n, s: 10n ** 9n, ms: 10n ** 6n, us: 1000n, ns: 1n };
  const parts = text.replaceAll('_', '').replace(/^[a-z]+#/i, '').toLowerCase();
  if (!/^(?:\d+(?:\.\d+)?(?:ms|us|ns|d|h|m|s))+$/.test(parts)) return undefined;
  let sum = 0n;
  for (const [, whole, fraction = '', unit] of parts.matchAll(/(\d+)(?:\.(\d+))?(ms|us|ns|d|h|m|s)/g)) {
    sum += (BigInt(whole + fraction) * units[unit]) / 10n ** BigInt(fraction.length);
  }
  return sum;
}

// What begins at the place of a node.
function asWritten(node, text) {
  const [file, line, column] = placeOf(node);
  const written = (lines[file]?.[line - 1] ?? '').slice(column - 1, column - 1 + text.length);
  return written.toUpperCase() === text.toUpperCase() ? written : text;
}

function withoutParentheses(node) {
  return node?.kind === 'ParenthesizedExpression' ? withoutParentheses(node.expression) : node;
}

function typeOf(node) {
  return kLongNames.get(node?.resolvedType?.name) ?? node?.resolvedType?.name;
}

// By file, line and column.
function byPlace({ place: one }, { place: other }) {
  return one[0] - other[0] || one[1] - other[1] || one[2] - other[2];
}

// The values of characters in memory: bytes of UTF-8, or units of UTF-16.
function valuesOf(characters, isWide) {
  return isWide ? Array.from({ length: characters.length }, (_, i) => characters.charCodeAt(i)) : [...Buffer.from(characters, 'utf8')];
}

const kEscapes = { N: '\n', L: '\n', R: '\r', T: '\t', P: '\f' };

// What IEC 61131-3 has of a text, without its quotes.
function valuesOfText(inner, isWide) {
  const part = isWide ? /\$(?:([\dA-F]{4})|(.))|([^$]+)/gis : /\$(?:([\dA-F]{2})|(.))|([^$]+)/gis;
  return [...inner.matchAll(part)].flatMap(([, code, letter, plain]) => {
    if (code !== undefined) return [parseInt(code, 16)];
    return valuesOf(letter === undefined ? (isWide ? plain : plain.replaceAll("''", "'")) : (kEscapes[letter.toUpperCase()] ?? letter), isWide);
  });
}

// What the C++ has that the compiler makes of it: a code takes all digits behind it, $" of a WSTRING is unknown to the compiler,
// '' is one ' also between ", and the value ends with the first NUL. undefined: it does not compile.
function valuesInCpp(inner, isWide) {
  const part = /\$(?:([\dA-F]{2})|([NLRTP$']))|''|\$|([^$'][^$']*)|'/gis;
  const made = [...inner.matchAll(part)].map(([all, code, letter, plain]) => {
    if (code !== undefined) return { code };
    if (letter !== undefined) return { plain: kEscapes[letter.toUpperCase()] ?? letter };
    if (all === '$') return { plain: '\\$' };
    return { plain: plain ?? "'" };
  });
  const values = [];
  for (let i = 0; i < made.length; ++i) {
    let { code, plain = '' } = made[i];
    if (code !== undefined) {
      const digits = /^[\dA-F]*/i.exec(made[i + 1]?.plain ?? '')[0];
      const value = parseInt(code + digits, 16);
      if (value > (isWide ? 0xffff : 0xff)) return undefined;
      values.push(value);
      if (digits !== '') made[i + 1].plain = made[i + 1].plain.slice(digits.length);
    }
    values.push(...valuesOf(plain, isWide));
  }
  const end = values.indexOf(0);
  return end < 0 ? values : values.slice(0, end);
}

// Why a text becomes another one in C++; undefined: it does not.
function textProblem(text, isWide) {
  const isSame = (one) => String(valuesOfText(one.slice(1, -1), isWide)) === String(valuesInCpp(one.slice(1, -1), isWide));
  if (isSame(text)) return undefined;
  const values = valuesOfText(text.slice(1, -1), isWide);
  if (values.includes(0)) return `STruC++ ends the text ${text} at the character ${isWide ? '$0000' : '$00'}; write it without`;
  const coded = isWide ? text.replace(/\$([$LNPRT]|[\dA-F]{4})|\$"/gi, (all, other) => (other === undefined ? '$0022' : all)) : text;
  if (coded !== text && isSame(coded)) return `STruC++ makes another text of ${text}: write $0022 in the place of $"`;
  const why = coded !== text ? 'it does not know $"' : isWide && text.includes("''") ? "it makes one ' of ''" : 'it takes digits and letters behind a code for a part of that';
  return `STruC++ makes another text of ${text}: ${why}`;
}

// Why a literal becomes another value in C++; undefined: it does not.
function literalProblem(node, isInitial, nanosecondsOf) {
  if (node.kind !== 'LiteralExpression' || (node.typePrefix ?? '') !== '') return undefined;
  const isWide = node.literalType === 'WSTRING';
  if (isWide || node.literalType === 'STRING') return textProblem(node.rawValue, isWide);
  const text = asWritten(node, node.rawValue);
  if (node.literalType === 'INT' && !isInitial && !text.includes('#')) {
    const value = integerOf(node);
    if (value !== undefined && String(value) !== String(node.value)) return `STruC++ makes ${node.value} of ${text}; write it with its type, as LINT#${text}`;
  }
  if (node.literalType === 'REAL' && text.includes('_')) return `STruC++ makes ${node.value} of ${text}; write it without _`;
  if (node.literalType === 'TIME' && nanosecondsOf !== undefined) {
    const exact = exactNanoseconds(text);
    const { nanoseconds } = nanosecondsOf(String(node.value));
    if (exact !== undefined && String(exact) !== String(nanoseconds)) return `STruC++ makes ${nanoseconds} ns of ${text}; write whole numbers, without _`;
  }
  return undefined;
}

// The part of a source that a node is; undefined: it has several lines.
function textOf({ sourceSpan }) {
  const { file, startLine, startCol, endLine, endCol } = sourceSpan;
  return startLine === endLine ? lines[fileNumbers.get(file)]?.[startLine - 1]?.slice(startCol - 1, endCol) : undefined;
}

const kParameters = ['VAR_INPUT', 'VAR_OUTPUT', 'VAR_IN_OUT'];

// Of a function or method, in the order of their declaration.
function parametersOf({ varBlocks }) {
  const sections = varBlocks.filter(({ blockType }) => kParameters.includes(blockType));
  return sections.flatMap((block) => block.declarations.flatMap((declaration) => declaration.names.map((name) => ({ name, block, declaration }))));
}

// Where the parenthesis of a call closes; undefined: it has none, or what follows it has several lines.
function endOfCall({ sourceSpan: { file, endLine, endCol } }) {
  const number = fileNumbers.get(file);
  const found = /\)\s*;?$/.exec(lines[number]?.[endLine - 1]?.slice(0, endCol) ?? '');
  return found === null ? undefined : { number, line: endLine, column: found.index + 1 };
}

// Gives the inputs that calls leave out their initial values, in the text: the compiler passes zeros to functions, and to
// methods nothing. Tells the calls that it cannot complete.
class Calls {
  constructor(plan) {
    this.plan = plan;
    this.types = new Map([...plan.ast.interfaces, ...plan.ast.functionBlocks].map((one) => [one.name.toUpperCase(), one]));
    this.functions = new Map(plan.ast.functions.map((pou) => [pou.name.toUpperCase(), pou]));
    // What the initial values in a method can name, besides the globals.
    this.scopes = new Map(plan.ast.functionBlocks.flatMap((block) => block.methods.map((method) => [method, plan.scopeOfBlock(block, new Map())])));
    this.problems = [];
    this.insertions = [];
    for (const { pou, body, scope, globals } of plan.bodies()) {
      this.isSame = (name) => scope.get(name) === globals.get(name);
      const links = new Set(); // of chains: they have the place of the whole chain
      for (const node of nodesIn(body)) if (node.kind === 'MethodCallExpression') links.add(node).add(node.object);
      for (const node of nodesIn(body)) {
        const method = this.methodOf(node, pou, scope);
        const called = node.kind === 'FunctionCallExpression' ? this.functions.get(node.functionName.toUpperCase()) : undefined;
        if (method !== undefined) this.completeMethod(node, method, links.has(node));
        else if (called !== undefined) this.completeFunction(node, called);
      }
    }
    this.checkSignatures();
    this.insertions.sort((one, other) => other.number - one.number || other.line - one.line || other.column - one.column);
    // In the source, before anything is inserted.
    this.problems = this.problems.sort(byPlace).map(inCharacters).map(inSource);
  }

  // Of a function block or an interface, or of one that it extends.
  methodIn(type, name, depth = 0) {
    const known = this.types.get(type?.toUpperCase());
    if (known === undefined || depth > kMostBases) return undefined;
    const own = known.methods.find((method) => method.name.toUpperCase() === name.toUpperCase());
    const bases = [known.extends ?? []].flat();
    return own ?? bases.map((base) => this.methodIn(base, name, depth + 1)).find((method) => method !== undefined);
  }
  // A call has the order of the type that it names, and reaches a method of one that extends or implements that.
  checkSignatures() {
    for (const block of this.plan.ast.functionBlocks) {
      const told = new Set();
      for (const [method, type] of this.typesAbove(block).flatMap(({ methods, name }) => methods.map((one) => [one, name]))) {
        const own = this.methodIn(block.name, method.name);
        const isSame = own === undefined || String(this.signatureOf(own)) === String(this.signatureOf(method));
        // An inherited one is told where it is declared, if it is wrong there already.
        if (isSame || told.has(own) || (!block.methods.includes(own) && !this.isNewTo(block, type))) continue;
        told.add(own);
        this.problems.push({
          place: placeOf(block.methods.includes(own) ? own : block),
          text: `${own.name}: its parameters are not those of ${type}, and STruC++ ignores their names in calls; declare them as there: ${this.signatureOf(method).join(', ') || 'none'}`,
        });
      }
    }
  }
  // All that a block extends or implements, also by way of another one.
  typesAbove(type, depth = 0) {
    const names = depth > kMostBases ? [] : [type.extends ?? [], type.implements ?? []].flat();
    const above = names.map((name) => this.types.get(name.toUpperCase())).filter((one) => one !== undefined);
    return above.flatMap((one) => [one, ...this.typesAbove(one, depth + 1)]);
  }
  // Not above the block that it extends.
  isNewTo(block, type) {
    const base = this.types.get(block.extends?.toUpperCase());
    return base === undefined || (base.name !== type && !this.typesAbove(base).some(({ name }) => name === type));
  }
  signatureOf(method) {
    return parametersOf(method).map(({ name, block, declaration }) => `${block.blockType} ${name} : ${this.plan.typeText(declaration.type)}`.toUpperCase());
  }

  // That a call in this POU means; undefined: it is no call of a method.
  methodOf(node, pou, scope) {
    if (node.kind === 'MethodCallExpression') return this.methodIn(this.methodOf(node.object, pou, scope)?.returnType?.name, node.methodName);
    if (node.kind !== 'FunctionCallExpression') return undefined;
    const [object, name] = node.functionName.toUpperCase().split('.');
    if (name === undefined) return this.methodIn(pou.name, object);
    if (object === 'SUPER') return this.methodIn(pou.extends, name);
    return this.methodIn(object === 'THIS' ? pou.name : scope.get(object)?.type, name);
  }

  // The initial value as text; undefined: it has none, or one of its names means something else to the caller, or nothing.
  valueOf({ block, declaration }, called) {
    if (block.blockType !== 'VAR_INPUT' || declaration.initialValue === undefined) return undefined;
    const own = this.plan.scopeOf(called.varBlocks, this.scopes.get(called) ?? new Map());
    const names = [...nodesIn(declaration.initialValue)].filter(({ kind }) => kind === 'VariableExpression').map(({ name }) => name.toUpperCase());
    return names.every((name) => this.isSame(name) && (!own.has(name) || this.plan.types.has(name))) ? textOf(declaration.initialValue) : undefined;
  }

  completeFunction(node, pou) {
    if (node.arguments.some((one) => one.name !== undefined)) return;
    const omitted = parametersOf(pou).slice(node.arguments.length);
    const last = omitted.findLastIndex(({ block, declaration }) => block.blockType === 'VAR_INPUT' && declaration.initialValue !== undefined);
    if (last < 0) return;
    const values = omitted.slice(0, last + 1).map((one) => this.valueOf(one, pou));
    const end = endOfCall(node);
    if (end !== undefined && values.every((value) => value !== undefined)) {
      this.insertions.push({ ...end, text: `${node.arguments.length > 0 ? ', ' : ''}${values.join(', ')}` });
    } else {
      this.problems.push({ place: placeOf(node), text: `${pou.name}: STruC++ makes zeros of inputs that are left out here; name one, as ${omitted[last].name} := ...` });
    }
  }

  // The compiler passes its arguments in the order of the call, whatever their names are.
  completeMethod(node, method, isInChain) {
    const tell = (text) => this.problems.push({ place: placeOf(node), text: `${method.name}: ${text}` });
    const parameters = parametersOf(method);
    const given = node.arguments.filter(({ name }) => !['EN', 'ENO'].includes(name?.toUpperCase()));
    const numbers = given.map(({ name }, i) => (name === undefined ? i : parameters.findIndex((one) => one.name.toUpperCase() === name.toUpperCase())));
    const unknown = numbers.findIndex((number) => number < 0 || number >= parameters.length);
    if (unknown >= 0) return tell(given[unknown].name === undefined ? 'this call has more arguments than the method has parameters' : `it has no parameter ${given[unknown].name}`);
    if (numbers.some((number, i) => i > 0 && number <= numbers[i - 1])) {
      return tell(`STruC++ ignores the names in a call of a method; write them in the order of the declaration: ${parameters.map(({ name }) => name).join(', ')}`);
    }
    const areNamed = given.some(({ name }) => name !== undefined);
    const end = endOfCall(node);
    const values = parameters.map((one, i) => (numbers.includes(i) || end === undefined || isInChain ? undefined : this.valueOf(one, method)));
    const missing = parameters.find((one, i) => !numbers.includes(i) && values[i] === undefined);
    if (missing !== undefined) {
      return tell(`STruC++ wants each parameter in this call of a method; add ${missing.name} ${missing.block.blockType === 'VAR_OUTPUT' ? '=>' : ':='} ...`);
    }
    const texts = values.map((value, i) => (value === undefined || !areNamed ? value : `${parameters[i].name} := ${value}`));
    const between = (first, next) => texts.slice(first, next);
    numbers.forEach((number, i) => {
      const [file, line, column] = placeOf(given[i]);
      const before = between((numbers[i - 1] ?? -1) + 1, number);
      if (before.length > 0) this.insertions.push({ number: file, line, column, text: `${before.join(', ')}, ` });
    });
    const behind = between((numbers.at(-1) ?? -1) + 1);
    if (behind.length > 0) this.insertions.push({ ...end, text: `${node.arguments.length > 0 ? ', ' : ''}${behind.join(', ')}` });
  }

  // Changes the text. Returns whether there was something to change.
  insertAll() {
    const added = this.insertions.map((one) => ({ ...one, place: inSource(inCharacters({ place: [one.number, one.line, one.column] })).place }));
    for (const { number, line, column, text, place } of added) {
      const before = lines[number][line - 1];
      lines[number][line - 1] = before.slice(0, column - 1) + text + before.slice(column - 1);
      sources[number].text = lines[number].join('\n');
      sources[number].inserted = [...(sources[number].inserted ?? []), { line, column: place[2], length: [...text].length, isInitial: true }];
      sources[number].inserted.sort((one, other) => one.line - other.line || one.column - other.column);
    }
    return added.length > 0;
  }
}

// The default of an enumeration's TYPE, which the compiler drops: in C++ it becomes that of its class. Arrays and aliases
// get this class, too, for the compiler gives them the bare enumeration, which begins with 0.
class Enumerations {
  constructor({ ast, headerCode }) {
    this.problems = [];
    this.defaults = new Map(); // values in C++, by the name of the type
    this.aliases = new Set();
    for (const type of ast.types) {
      const { kind, defaultValue } = type.definition;
      if (kind !== 'EnumDefinition' || defaultValue === undefined) continue;
      const name = type.name.toUpperCase();
      const members = new RegExp(`^enum class ${name}\\b[^{]*\\{([^}]*)\\}`, 'm').exec(headerCode)?.[1] ?? '';
      const value = new RegExp(`\\b${defaultValue}_?(?=\\s*(?:[,=]|$))`, 'i').exec(members)?.[0];
      if (value === undefined) this.problems.push({ place: placeOf(type), text: `${defaultValue} is no value of ${type.name}` });
      else this.defaults.set(name, value);
    }
    for (let before = -1; before !== this.aliases.size; ) {
      before = this.aliases.size;
      for (const { name, definition } of ast.types) {
        const of = definition.kind === 'TypeReference' ? definition.name.toUpperCase() : '';
        if (this.defaults.has(of) || this.aliases.has(of)) this.aliases.add(name.toUpperCase());
      }
    }
  }

  // Of C++, in which texts stay as they are.
  withDefaults(code) {
    if (this.defaults.size === 0) return code;
    const names = [...this.defaults.keys()].join('|');
    const made = code
      .replace(new RegExp(`"(?:\\\\.|[^"\\\\\n])*"|(\\bArray(?:View)?\\dD<)(?=(?:${names})[,>])`, 'g'), (all, array) => (array === undefined ? all : `${array}IEC_`))
      .replace(new RegExp(`^(using IEC_(${names}) = IEC_ENUM<\\2>;)`, 'gm'), (all, line, name) => `${line} template <> constexpr IEC_ENUM_Value<${name}>::IEC_ENUM_Value() noexcept : value_(${name}::${this.defaults.get(name)}) {}`);
    if (this.aliases.size === 0) return made;
    const aliases = [...this.aliases].join('|');
    return made
      .replace(new RegExp(`^(using (?:${aliases}) = )(?=(?:${names});)`, 'gm'), '$1IEC_')
      .replace(new RegExp(`^using IEC_(${aliases}) = IECVar<\\1>;`, 'gm'), 'using IEC_$1 = $1;');
  }
}

// Located variables of a program may share bits with others: plchost_to() assigns one, and knows them.
function withAssigned(code, pous) {
  return code.replace(/^void Program_(\w+)::run\(\) \{\n[\s\S]*?^\}/gm, (body, program) => {
    const variables = pous.find((pou) => pou.kind === 'program' && pou.name.toUpperCase() === program)?.variables ?? [];
    const names = variables.filter((one) => /^%[QM]/i.test(one.location) && one.member !== '').map((one) => one.member);
    if (names.length === 0) return body;
    return body.replace(new RegExp(`"(?:\\\\.|[^"\\\\\n])*"|(?<![\\w.>])(${names.join('|')})(?= = )`, 'g'), (all, name) => (name === undefined ? all : `plchost_to(${name})`));
  });
}

class Plan {
  constructor(result) {
    this.ast = result.ast;
    this.header = result.headerCode;
    this.remarks = [];
    this.dropped = new Map(); // arrays with initial values, by their place
    this.classes = this.readClasses();
    this.blocks = new Map(this.ast.functionBlocks.map((block) => [block.name.toUpperCase(), block]));
    this.functions = new Set(this.ast.functions.map((one) => one.name.toUpperCase()));
    this.types = new Map(this.ast.types.map((type) => [type.name.toUpperCase(), type]));
    this.globals = this.readGlobals();
  }

  // The members of each class of the header: it says how they are called in C++, and has those of libraries.
  readClasses() {
    const classes = new Map();
    for (const [, name, body] of this.header.matchAll(/^class (\w+)(?: *: *[^{;]*)? \{\n([\s\S]*?)^\};/gm)) {
      const members = new Map();
      for (const [, type, member] of body.matchAll(/^ {4}(?!static |explicit |virtual |using |friend )(\w[\w:<>, *&-]*?[>\w*&]) ?\b(\w+)(?: *=[^;\n]*|\{[^;\n]*\})?;/gm)) {
        members.set(member, type);
      }
      classes.set(name, members);
    }
    return classes;
  }

  // A block that others extend is seen several times.
  remark(node, text) {
    const place = placeOf(node);
    if (this.remarks.some((one) => one.text === text && String(one.place) === String(place))) return;
    this.remarks.push({ place, text });
  }

  // Whether values of a type cannot be copied from one version of the program to another.
  hasReferences(name, depth = 0) {
    const upper = name.toUpperCase();
    if (depth > 32 || this.isBlock(upper) || this.ast.interfaces.some((one) => one.name.toUpperCase() === upper)) return true;
    const definition = this.types.get(upper)?.definition;
    if (definition === undefined) return false;
    if (definition.kind === 'StructDefinition') return definition.fields.some((field) => this.isReference(field.type, depth + 1));
    if (definition.kind === 'ArrayDefinition') return this.isReference(definition.elementType, depth + 1);
    return definition.kind === 'TypeReference' && this.isReference(definition, depth + 1);
  }
  isReference(type, depth = 0) {
    return type.isReference || (type.referenceKind ?? 'none') !== 'none' || this.hasReferences(type.elementTypeName ?? type.name, depth);
  }
  isBlock(name) {
    return this.blocks.has(name) || (this.classes.has(name) && !name.startsWith('Program_') && !name.startsWith('Configuration_'));
  }

  typeText(type) {
    let text = type.elementTypeName ?? type.name;
    if (type.maxLength !== undefined) text += `(${type.maxLength})`;
    if (type.arrayDimensions !== undefined) text = `ARRAY [${type.arrayDimensions.map((d) => `${d.start}..${d.end}`).join(', ')}] OF ${text}`;
    return text;
  }

  placeOfFirst(declaration, node) {
    const [number, line] = placeOf(node);
    const found = places.get(`${number}:${line}:${declaration.names[0].toUpperCase()}`);
    if (found === undefined) return '';
    found.isTaken = true;
    return found.location;
  }

  // A declared variable; of an array of function blocks its elements.
  variables(block, declaration, name, member, node) {
    const sections = { VAR_INPUT: 'input', VAR_OUTPUT: 'output', VAR_IN_OUT: 'in_out', VAR_TEMP: 'temporary', VAR_EXTERNAL: 'external', VAR_GLOBAL: 'global' };
    const variable = {
      name,
      type: this.typeText(declaration.type),
      location: declaration.address ?? this.placeOfFirst(declaration, node),
      section: sections[block.blockType] ?? 'local',
      retain: block.isRetain === true,
      constant: block.isConstant === true,
      place: placeOf(node),
      member: member ?? '',
    };
    if (member === undefined && variable.section !== 'external') variable.section = 'other';
    const element = declaration.type.elementTypeName?.toUpperCase();
    const type = element ?? declaration.type.name.toUpperCase();
    if (/^CTU?D(_\w+)?$/.test(type) && !this.blocks.has(type)) this.remark(node, `${name}: STruC++ counts falling edges of CD of ${type}; IEC 61131-3 counts rising ones`);
    if (type === 'F_TRIG' && !this.blocks.has(type)) this.remark(node, `${name}: F_TRIG of STruC++ has no edge in its first cycle; that of IEC 61131-3 has one if CLK is FALSE`);
    const dimensions = declaration.type.arrayDimensions;
    if (element !== undefined && dimensions !== undefined && this.isBlock(element)) return this.elements(variable, element, dimensions);
    const isBlock = this.isBlock(declaration.type.name.toUpperCase()) && (declaration.type.referenceKind ?? 'none') === 'none';
    if (!isBlock && this.isReference(declaration.type)) variable.type = `REFERENCE ${variable.type}`;
    return [variable];
  }
  elements(variable, type, dimensions) {
    let indexes = [[]];
    for (const { start, end } of dimensions) {
      if (indexes.length * (end - start + 1) > kMostElements) {
        this.remarks.push({ place: variable.place, text: `${variable.name} has more than ${kMostElements} function blocks: they begin anew in an online change, and are not retained` });
        return [];
      }
      indexes = indexes.flatMap((before) => Array.from({ length: end - start + 1 }, (_, i) => [...before, start + i]));
    }
    return indexes.map((index) => ({
      ...variable,
      // No letter of a name that plcctl knows is a minus.
      name: `${variable.name}.${index.map((i) => `${i}`.replace('-', 'm')).join('.')}`,
      type,
      member: index.length === 1 ? `${variable.member}[${index[0]}]` : `${variable.member}(${index.join(', ')})`,
    }));
  }

  noteDropped(declaration, name) {
    if (declaration.initialValue?.kind === 'ArrayLiteralExpression') this.dropped.set(`${placeOf(declaration)}`, { place: placeOf(declaration), name });
  }

  noteAllDropped(blocks) {
    for (const block of blocks) {
      for (const declaration of block.declarations) this.noteDropped(declaration, namesAsWritten(declaration)[0]);
    }
  }

  // The compiler says nothing of either. Arrays of function blocks, functions, methods and of VAR_GLOBAL outside of a
  // CONFIGURATION begin as they should.
  checkWhatIsDropped() {
    for (const { name, definition } of this.ast.types) {
      for (const field of definition.kind === 'StructDefinition' ? definition.fields : []) this.noteDropped(field, `${name}.${field.names[0]}`);
    }
    for (const { place, name } of this.dropped.values()) {
      this.remarks.push({ place, text: `STruC++ drops the initial values of the array ${name}: its elements begin with zeros` });
    }
    const standard = StdFunctionRegistry === undefined ? undefined : new StdFunctionRegistry();
    return this.ast.functions
      .filter((pou) => standard?.isStandardFunction(pou.name) === true)
      .map((pou) => ({ place: placeOf(pou), text: `STruC++ calls its own function ${pou.name} in the place of this one; choose another name` }));
  }

  // Numbers and times that become others in C++, of which the compiler says nothing, or not where.
  checkLiterals(nanosecondsOf) {
    const initial = new Set();
    for (const node of nodesIn(this.ast)) {
      if (Array.isArray(node.names) && node.initialValue !== undefined) for (const value of nodesIn(node.initialValue)) initial.add(value);
    }
    const problems = [];
    for (const node of nodesIn(this.ast)) {
      const text = literalProblem(node, initial.has(node), nanosecondsOf);
      if (text !== undefined) problems.push({ place: placeOf(node), text });
    }
    return problems.sort(byPlace);
  }

  // Of the call of a standard function: DINT_TO_TIME(x), TO_TIME(x).
  conversionOf(call) {
    const name = call.functionName.toUpperCase();
    const [, written, to] = /^(?:(\w+)_)?TO_(\w+)$/.exec(name) ?? [];
    return { name, written, to, from: kLongNames.get(written) ?? written ?? typeOf(call.arguments[0]?.value), target: kLongNames.get(to) ?? to };
  }

  // It has dates in days, and dates with a time in nanoseconds, and does not convert one to the other.
  checkTimes() {
    const problems = [];
    for (const node of nodesIn(this.ast)) {
      let text;
      if (node.kind === 'BinaryExpression' && (node.operator === '-' || node.operator === '+')) {
        const [left, right] = [typeOf(node.left), typeOf(node.right)];
        const isOfDays = (left === 'DATE' && (right === 'DATE' || right === 'TIME')) || (left === 'TIME' && right === 'DATE');
        if (isOfDays) text = `STruC++ counts days here, and nanoseconds in a TIME: write DT in the place of DATE`;
      } else if (node.kind === 'FunctionCallExpression' && !this.functions.has(node.functionName.toUpperCase())) {
        const { name, from, target } = this.conversionOf(node);
        const isOfDates = ['DATE', 'TOD', 'DT'].includes(from) && ['DATE', 'TOD', 'DT'].includes(target) && from !== target;
        if (isOfDates) text = `${name}: STruC++ copies the number, which counts days in a DATE, and nanoseconds in TOD and DT`;
        const isLiteral = node.arguments[0]?.value?.kind === 'LiteralExpression';
        if (from === 'STRING' && target === 'BOOL' && isLiteral) text = `${name}: STruC++ makes TRUE of each text that is no variable; write TRUE or FALSE`;
        if (['DATE', 'TOD', 'DT', 'TIME'].includes(from) && target === 'STRING') this.remark(node, `${name}: STruC++ writes the number of ${from === 'DATE' ? 'days' : 'nanoseconds'}`);
      }
      if (text !== undefined) problems.push({ place: placeOf(node), text });
    }
    return problems.sort(byPlace);
  }

  // It compares with the end by the sign of a step that is a number, and counts on before.
  checkLoops() {
    const before = this.remarks.length;
    for (const pou of [...this.ast.programs, ...this.ast.functionBlocks, ...this.ast.functions]) {
      const types = new Map();
      for (const node of nodesIn(pou)) {
        if (Array.isArray(node.names)) for (const name of node.names) types.set(name.toUpperCase(), node.type?.name?.toUpperCase());
      }
      for (const node of nodesIn(pou)) {
        if (node.kind !== 'ForStatement') continue;
        const step = node.step === undefined ? 1n : integerOf(node.step);
        const range = kRanges.get(types.get(node.controlVariable.toUpperCase()));
        if (step === undefined) {
          this.remark(node, 'STruC++ compares as if the step of this FOR were positive: with a negative one it has no turn, or does not end');
        } else if (range !== undefined && integerOf(node.end) === range[step < 0n ? 0 : 1]) {
          this.remark(node, `this FOR does not end by itself with STruC++: no value of its variable lies beyond ${integerOf(node.end)}`);
        }
      }
    }
    this.remarks.push(...this.remarks.splice(before).sort(byPlace));
  }

  // By name: whether it is a constant, and its type.
  scopeOf(sections, outer) {
    const scope = new Map(outer);
    for (const { blockType, isConstant, declarations } of sections) {
      for (const { names, type } of declarations) {
        for (const name of names.map((one) => one.toUpperCase())) {
          const isOfGlobal = blockType === 'VAR_EXTERNAL' && outer.get(name)?.isConstant === true;
          scope.set(name, { isConstant: isConstant === true || isOfGlobal, type: type.name.toUpperCase() });
        }
      }
    }
    return scope;
  }
  scopeOfBlock(pou, globals, depth = 0) {
    const base = depth < kMostBases ? this.blocks.get(pou.extends?.toUpperCase()) : undefined;
    return this.scopeOf(pou.varBlocks, base === undefined ? globals : this.scopeOfBlock(base, globals, depth + 1));
  }

  // Each body, with its POU and the variables that it can name.
  *bodies() {
    const sections = [...this.ast.configurations.flatMap((one) => one.varBlocks), ...this.ast.globalVarBlocks];
    const globals = this.scopeOf(sections, new Map());
    for (const pou of [...this.ast.programs, ...this.ast.functionBlocks, ...this.ast.functions]) {
      const scope = this.scopeOfBlock(pou, globals);
      yield { pou, body: pou.body, scope, globals };
      for (const method of pou.methods ?? []) yield { pou, body: method.body, scope: this.scopeOf(method.varBlocks, scope), globals };
      for (const property of pou.properties ?? []) yield { pou, body: [property.getter, property.setter], scope, globals };
    }
  }

  // The compiler refuses a constant as the target of a statement only if the POU itself declares it as one.
  checkConstants() {
    const problems = [];
    for (const { body, scope } of this.bodies()) {
      for (const node of nodesIn(body)) {
        for (const target of this.writtenBy(node, scope)) {
          const { kind, name, accessChain, isDereference } = target;
          const isReached = isDereference === true || accessChain?.some((step) => step.kind === 'dereference') === true;
          if (kind !== 'VariableExpression' || isReached || scope.get(name.toUpperCase())?.isConstant !== true) continue;
          problems.push({ place: placeOf(target), text: `${asWritten(target, name)} is CONSTANT, and STruC++ would write it; write another variable` });
        }
      }
    }
    return problems.sort(byPlace);
  }

  // Variables that a statement or call writes.
  writtenBy(node, scope) {
    if (node.kind === 'AssignmentStatement') return [node.target];
    if (node.kind === 'ForStatement') {
      const { sourceSpan } = node;
      return [{ kind: 'VariableExpression', name: nameAsWritten({ name: node.controlVariable, sourceSpan }, 'FOR'), sourceSpan }];
    }
    if (node.kind === 'MethodCallExpression') return node.arguments.filter((one) => one.isOutput).map((one) => one.value);
    if (node.kind !== 'FunctionCallExpression') return [];
    const name = node.functionName.toUpperCase();
    const called = this.blocks.get(scope.get(name)?.type) ?? this.ast.functions.find((one) => one.name.toUpperCase() === name);
    const namesOf = (sections) => sections.flatMap(({ declarations }) => declarations.flatMap(({ names }) => names.map((one) => one.toUpperCase())));
    const ofCaller = called?.varBlocks.filter(({ blockType }) => kParameters.includes(blockType)) ?? [];
    const parameters = namesOf(ofCaller);
    const written = new Set(namesOf(ofCaller.filter(({ blockType }) => blockType === 'VAR_IN_OUT')));
    return node.arguments.filter((one, i) => one.isOutput || written.has(one.name?.toUpperCase() ?? parameters[i])).map((one) => one.value);
  }

  // Values that MATIEC makes as IEC 61131-3 says, and this compiler does not. Roundings are the last ones, as there can be many.
  checkDifferences() {
    const [values, roundings] = [[], []];
    for (const node of nodesIn(this.ast)) {
      const tell = (list, text) => list.push({ place: placeOf(node), text });
      if (node.kind === 'BinaryExpression' && kComparisons.has(node.operator)) {
        const wraps = (one) => one?.kind === 'BinaryExpression' && one.operator === '-' && (typeOf(one) === 'USINT' || typeOf(one) === 'UINT');
        const difference = [node.left, node.right].map(withoutParentheses).find(wraps);
        if (difference !== undefined) tell(values, `this difference of ${typeOf(difference)} wraps before STruC++ compares it: assign it first`);
      }
      if (node.kind !== 'FunctionCallExpression' || this.functions.has(node.functionName.toUpperCase())) continue;
      const { name, written, to, from, target } = this.conversionOf(node);
      const isNumber = (type) => kRanges.has(type) || type === 'REAL' || type === 'LREAL';
      if ((written === 'TIME' && isNumber(to)) || (isNumber(written) && to === 'TIME')) tell(values, `${name}: STruC++ counts milliseconds, and MATIEC seconds`);
      const given = withoutParentheses(node.arguments[0]?.value);
      const isSure = given?.kind === 'LiteralExpression' && Math.abs(Number(given.value)) % 1 !== 0.5;
      if ((from === 'REAL' || from === 'LREAL') && kRanges.has(target) && !isSure) tell(roundings, `${name}: STruC++ rounds 2.5 to 3, and IEC 61131-3 to 2`);
    }
    this.remarks.push(...values.sort(byPlace), ...roundings.sort(byPlace));
  }

  // As the compiler calls a member, which it does not always call as the source does.
  memberOf(className, name) {
    const members = this.classes.get(className);
    return [name, `${name}_`].find((candidate) => members?.has(candidate));
  }

  declared(pou, className) {
    const found = [];
    for (const block of pou.varBlocks) {
      for (const declaration of block.declarations) {
        for (const name of namesAsWritten(declaration)) {
          const member = this.memberOf(className, name.toUpperCase());
          found.push(...this.variables(block, declaration, name, member, declaration));
        }
      }
    }
    return found;
  }

  // What a POU reaches without declaring it: globals, and the functions that it calls.
  reached(pou) {
    const own = new Set(pou.varBlocks.flatMap((block) => block.declarations.flatMap((declaration) => declaration.names.map((name) => name.toUpperCase()))));
    const externals = new Set();
    const calls = new Set();
    for (const node of nodesIn(pou)) {
      const name = (node.kind === 'FunctionCallExpression' ? node.functionName : node.kind === 'VariableExpression' ? node.name : '').toUpperCase();
      if (name === '' || own.has(name)) continue;
      if (this.functions.has(name)) calls.add(name);
      if (this.globals.names.has(name)) externals.add(name);
      if (node.kind === 'NewExpression') this.remark(node, `${pou.name} takes memory while it runs (__NEW): its cycles may take longer than planned`);
    }
    const base = { location: '', retain: false, constant: false, place: placeOf(pou), member: '' };
    return [
      ...[...externals].map((name) => ({ ...base, name, type: this.globals.names.get(name), section: 'external' })),
      ...[...calls].map((name) => ({ ...base, name: `CALL.${name}`, type: name, section: 'other' })),
    ];
  }

  // Those of the blocks that it extends are its own, too.
  blockVariables(block, depth = 0) {
    const base = block.extends?.toUpperCase();
    let inherited = [];
    if (base !== undefined && depth < kMostBases) {
      inherited = this.blocks.has(base) ? this.blockVariables(this.blocks.get(base), depth + 1) : this.libraryVariables(base);
    }
    return [...inherited, ...this.declared(block, block.name), ...this.reached(block)];
  }
  libraryVariables(name) {
    const found = [];
    for (const [member, type] of this.classes.get(name) ?? []) {
      if (member === 'ENO') continue;
      const variable = { name: member.replace(/_$/, ''), type, location: '', section: 'local', retain: false, constant: false, place: [-1, 0, 0], member };
      const array = /^Array1D<(\w+), (-?\d+), (-?\d+)>$/.exec(type);
      if (array !== null && this.isBlock(array[1])) {
        found.push(...this.elements(variable, array[1], [{ start: Number(array[2]), end: Number(array[3]) }]));
        continue;
      }
      const names = type.match(/\w+/g) ?? [];
      if (/[*&]|IEC_REF_TO|IEC_REFERENCE_TO|IEC_Ptr/.test(type) || (!this.isBlock(type) && names.some((one) => this.isBlock(one)))) variable.type = `REFERENCE ${type}`;
      found.push(variable);
    }
    return found;
  }

  readGlobals() {
    const names = new Map();
    const found = [];
    const add = (block, wrap) => {
      for (const declaration of block.declarations) {
        for (const name of namesAsWritten(declaration)) {
          names.set(name.toUpperCase(), this.typeText(declaration.type));
          found.push(...this.variables({ ...block, blockType: 'VAR_GLOBAL' }, declaration, name, wrap(name.toUpperCase()), declaration));
        }
      }
    };
    for (const configuration of this.ast.configurations) {
      for (const block of configuration.varBlocks) add(block, (name) => `${name}.value`);
      this.noteAllDropped(configuration.varBlocks);
    }
    for (const block of this.ast.globalVarBlocks) add(block, (name) => name);
    return { names, found };
  }

  pous() {
    const pous = [];
    const words = { program: 'PROGRAM', function_block: 'FUNCTION_BLOCK(?:\\s+(?:ABSTRACT|FINAL))*', function: 'FUNCTION' };
    const user = (kind, list, className, variables) => {
      for (const pou of list) pous.push({ kind, name: nameAsWritten(pou, words[kind]), place: placeOf(pou), variables: variables(pou, className(pou)) });
    };
    user('program', this.ast.programs, (pou) => `Program_${pou.name}`, (pou, name) => [...this.declared(pou, name), ...this.reached(pou)]);
    for (const pou of this.ast.programs) this.noteAllDropped(pou.varBlocks);
    user('function_block', this.ast.functionBlocks, (pou) => pou.name, (pou) => this.blockVariables(pou));
    user('function', this.ast.functions, (pou) => pou.name, (pou) => this.reached(pou));
    for (const name of this.classes.keys()) {
      if (this.isBlock(name) && !this.blocks.has(name)) pous.push({ kind: 'function_block', name, place: [-1, 0, 0], variables: this.libraryVariables(name) });
    }
    return pous;
  }

  typeList() {
    const strip = (key, value) => (key === 'sourceSpan' || key === 'parent' || key === 'resolvedType' ? undefined : value);
    return this.ast.types.map((type) => ({ name: type.name, definition: JSON.stringify(type.definition, strip), place: placeOf(type) }));
  }

  configurations() {
    return this.ast.configurations.map((configuration) => ({
      name: nameAsWritten(configuration, 'CONFIGURATION'),
      place: placeOf(configuration),
      globals: this.globals.found,
      resources: configuration.resources.map((resource) => ({
        name: nameAsWritten(resource, 'RESOURCE'),
        place: placeOf(resource),
        tasks: resource.tasks.map((task) => this.task(task)),
        programs: resource.programInstances.map((program) => ({
          name: nameAsWritten(program, 'PROGRAM'),
          type: program.programType,
          task: program.taskName ?? '',
          place: placeOf(program),
        })),
      })),
    }));
  }
  task(task) {
    const text = (key) => {
      const value = task.properties.get(key);
      if (value === undefined) return '';
      if (value.kind === 'VariableExpression') return [value.name, ...value.fieldAccess].join('.');
      return value.kind === 'LiteralExpression' ? String(value.rawValue) : '?';
    };
    return { name: nameAsWritten(task, 'TASK'), interval: text('INTERVAL'), single: text('SINGLE'), priority: text('PRIORITY'), place: placeOf(task) };
  }
}

// The compiler's table for debuggers, and why some variables are not in it. It is made again: the compiler's own one has
// neither the globals outside of a CONFIGURATION nor what a block inherits. For the latter, blocks get all their variables
// themselves: nothing else may use them behind that.
async function debugTable({ ast, projectModel, symbolTables, debugTableCpp }) {
  const maker = join(folder, 'dist', 'backend', 'debug-table-gen.js');
  if (projectModel === undefined || symbolTables === undefined || !existsSync(maker)) return { table: debugTableCpp ?? '', skipped: [] };
  const { generateDebugTable } = await import(pathToFileURL(maker).href);
  const heirs = ast.functionBlocks.filter((block) => block.extends !== undefined);
  const sectionsOf = (name, depth = 0) => {
    const block = symbolTables.lookupFunctionBlock(name.toUpperCase());
    if (block === undefined || depth > kMostBases) return [];
    const { extends: base, varBlocks } = block.declaration;
    const ofLibrary = [...block.inputs, ...block.outputs].map((one) => ({ blockType: 'VAR_INPUT', declarations: [{ names: [one.name], type: one.declaration.type }] }));
    return [...(base === undefined ? [] : sectionsOf(base, depth + 1)), ...(ofLibrary.length > 0 ? ofLibrary : varBlocks)];
  };
  const whole = heirs.map((block) => [symbolTables.lookupFunctionBlock(block.name.toUpperCase()), sectionsOf(block.name)]);
  for (const [block, sections] of whole) {
    if (block !== undefined) block.declaration.varBlocks = sections;
  }
  const outside = { varBlocks: ast.globalVarBlocks };
  const made = generateDebugTable({ ...ast, configurations: [...ast.configurations, outside] }, projectModel, symbolTables);
  return { table: withPlainGlobals(made.debugTableCpp, outside), skipped: made.skipped ?? [] };
}

// Those outside of a CONFIGURATION are no members of an object with a mutex.
function withPlainGlobals(table, { varBlocks }) {
  const names = varBlocks.flatMap((block) => block.declarations.flatMap((declaration) => declaration.names));
  return names.reduce((text, name) => text.replaceAll(`(void*)&${name}.value`, `(void*)&${name}`), table);
}

// Each array as one: GRID[][].X.
function pattern(path) {
  return path.replace(/\[-?\d+\]/g, '[]');
}

// Of the variables that the table leaves out.
function hiddenOf(skipped) {
  const texts = [
    [/^(?:unknown elementary type|unresolved type name): (\w+)$/, 'its type $1 is not known'],
    [/^library type (\w+) is opaque to the debugger$/, 'its type $1 is one of a library'],
    [/^array bounds not constant$/, 'its bounds are no numbers'],
  ];
  const found = new Map();
  for (const { path, reason } of skipped) {
    const [form, text] = texts.find(([one]) => one.test(reason)) ?? [/^/, 'STruC++ leaves it out: '];
    found.set(pattern(path), { name: pattern(path), why: reason.replace(form, text) });
  }
  return [...found.values()];
}

// The variables of the compiler's table for debuggers, each array as one: GRID[][].X and the bounds of its indexes. An
// entry of the table: { (void*)&g_config.ONE.GRID[-1][0].X, TAG_REAL, 0 },  // ONE.GRID[-1][0].X
function symbolsOf(table) {
  const found = new Map();
  for (const [, value, type, path] of table.matchAll(/^ *\{ \(void\*\)&([\w.[\]-]+), TAG_(\w+), [^}]*\}, *\/\/ ([\w.[\]-]+)$/gm)) {
    const indexes = Array.from(path.matchAll(/\[(-?\d+)\]/g), ([, index]) => Number(index));
    const known = found.get(pattern(path));
    if (known === undefined) {
      found.set(pattern(path), { name: pattern(path), type, value: pattern(value), bounds: indexes.map((index) => [index, index]) });
    } else {
      indexes.forEach((index, i) => (known.bounds[i] = [Math.min(known.bounds[i][0], index), Math.max(known.bounds[i][1], index)]));
    }
  }
  return [...found.values()];
}

// Its function for times, in a private part of it: a version without has no check.
async function timesOfCompiler() {
  const model = join(folder, 'dist', 'project-model.js');
  return existsSync(model) ? (await import(pathToFileURL(model).href)).parseTimeLiteral : undefined;
}

// Of the source, without what was inserted.
function inSource({ place: [file, line, column], text, ...rest }) {
  let isInitial = false;
  for (const one of sources[file]?.inserted ?? []) {
    if (one.line !== line || one.column > column) continue;
    isInitial ||= one.isInitial === true && column - one.column < one.length;
    column -= Math.min(one.length, column - one.column);
  }
  return { ...rest, place: [file, line, column], text: isInitial ? `${text}: the initial value of an input that this call leaves out; give the input` : text };
}

// The compiler counts units of UTF-16.
function inCharacters({ place: [file, line, column], ...rest }) {
  const before = (lines[file]?.[line - 1] ?? '').slice(0, Math.max(column - 1, 0));
  return { ...rest, place: [file, line, column - before.length + [...before].length] };
}

function bounded(messages) {
  const more = messages.length - kMostMessages;
  if (more <= 0) return messages;
  return [...messages.slice(0, kMostMessages), { place: [-1, 0, 0], text: `${more} more messages of this kind are not told` }];
}

let result = translate();
const calls = result.success ? new Calls(new Plan(result)) : undefined;
if (calls?.insertAll() === true) result = translate();
const plan = {
  format: 1,
  problems: result.success ? [] : bounded(result.errors.map(message)),
  remarks: [],
  files: [],
  pous: [],
  types: [],
  symbols: [],
  hidden: [],
  configurations: [],
};
if (!result.success && plan.problems.length === 0) plan.problems.push({ place: [-1, 0, 0], text: 'STruC++ has failed, and has not said why' });
if (result.success) {
  const found = new Plan(result);
  const enumerations = new Enumerations(result);
  plan.pous = found.pous();
  plan.types = found.typeList();
  plan.configurations = found.configurations();
  plan.problems.push(...enumerations.problems);
  plan.problems.push(...found.checkWhatIsDropped(), ...found.checkLiterals(await timesOfCompiler()), ...found.checkTimes(), ...found.checkConstants());
  for (const { number, line, name, location, isTaken } of places.values()) {
    if (isTaken !== true) plan.problems.push({ place: [number, line, 0], text: `${name} AT ${location}: the declaration is not understood` });
  }
  found.checkLoops();
  found.checkDifferences();
  const { table, skipped } = await debugTable(result);
  plan.symbols = symbolsOf(table);
  plan.hidden = hiddenOf(skipped);
  if (plan.hidden.length > kMostMessages) {
    found.remarks.push({ place: [-1, 0, 0], text: `${plan.hidden.length} variables cannot be seen from outside, of which ${kMostMessages} are named` });
    plan.hidden.length = kMostMessages;
  }
  if (plan.symbols.length > kMostSymbols) {
    found.remarks.push({ place: [-1, 0, 0], text: `${plan.symbols.length} variables: those beyond ${kMostSymbols} cannot be seen from outside` });
    plan.symbols.length = kMostSymbols;
  }
  // Its task for a program without one is not used.
  const warnings = result.warnings.filter((warning) => !warning.message.includes('has no task assignment'));
  plan.remarks = bounded([...warnings.map(message), ...found.remarks]);
  for (const file of result.cppFiles) {
    writeFileSync(file.name, withAssigned(enumerations.withDefaults(file.content), plan.pous), { flag: 'wx' });
    plan.files.push(file.name);
  }
  writeFileSync('generated.hpp', enumerations.withDefaults(result.headerCode), { flag: 'wx' });
  writeFileSync('debug_table.cpp', table, { flag: 'wx' });
  writeFileSync('debug_map.json', JSON.stringify(result.debugMap ?? {}), { flag: 'wx' });
}
plan.problems = [...plan.problems.map(inCharacters).map(inSource), ...(calls?.problems ?? [])];
plan.remarks = plan.remarks.map(inCharacters).map(inSource);
writeFileSync('plan.json', JSON.stringify(plan), { flag: 'wx' });
