'use strict';
// Equations as a person types them ("F = -C_d (rho/2) c l |h'| h'"), set as MathML. Words stay words; what is not understood stays as it is typed.
const unrigEquation = (() => {
  const ns = 'http://www.w3.org/1998/Math/MathML';
  const greek = {alpha: 'α', beta: 'β', gamma: 'γ', delta: 'δ', epsilon: 'ε', zeta: 'ζ', eta: 'η', theta: 'θ', kappa: 'κ', lambda: 'λ', mu: 'μ', nu: 'ν', xi: 'ξ', pi: 'π', rho: 'ρ', sigma: 'σ', tau: 'τ',
    phi: 'φ', chi: 'χ', psi: 'ψ', omega: 'ω', Delta: 'Δ', Omega: 'Ω'};
  const functions = ['exp', 'log', 'sin', 'cos', 'tan', 'tanh', 'sign', 'min', 'max', 'clamp'];
  const operators = {'->': '→', '-': '−', '+=': '+=', '>=': '≥', '<=': '≤', '..': '…'};
  const make = (name, parent, text) => {
    const made = document.createElementNS(ns, name);
    if (text !== undefined) made.textContent = text;
    if (parent) parent.appendChild(made);
    return made;
  };

  const tokens = (text) => text.match(/\s*\*\s*|[A-Za-zα-ωΑ-Ω]+|\d+(?:\.\d+)?(?:e[-+]?\d+)?|'+|->|\+=|>=|<=|\.\.|\s+|./gu) || [];

  function set(text) {
    const words = tokens(text);
    let at = 0;
    const skip = () => { while (at < words.length && /^\s+$/.test(words[at])) ++at; };
    const is_word = (word) => /^[A-Za-zα-ωΑ-Ω]+$/u.test(word || '');

    const symbol = (word) => {
      if (greek[word]) return make('mi', null, greek[word]);
      if (word === 'sum') return make('mo', null, '∑');
      if (word === 'Int') return make('mo', null, '∫');
      if (word.length === 1) return make('mi', null, word);
      const name = make('mi', null, word);
      name.setAttribute('mathvariant', 'normal');
      return name;
    };
    // What stands behind _ or ^: a sign, a bracket without its brackets, a symbol with its index.
    const script = () => {
      if (words[at] === '(') { ++at; return row(')'); }
      const inner = make('mrow');
      if (words[at] === '-' || words[at] === '+') make('mo', inner, words[at++] === '-' ? '−' : '+');
      const word = words[at++];
      if (word !== undefined) inner.appendChild(/^\d/.test(word) ? make('mn', null, word) : is_word(word) ? symbol(word) : make('mo', null, word));
      return inner;
    };
    // A symbol, number or bracket with its index, primes and power.
    const dressed = (base) => {
      let index = null, power = null, primes = '';
      for (;;) {
        if (words[at] === '_' && at + 1 < words.length) {
          ++at;
          if (words[at] === 'rate') { ++at; const dotted = make('mover'); dotted.append(base, make('mo', null, '˙')); base = dotted; continue; }
          index = script();
        } else if (words[at] === '^' && at + 1 < words.length) { ++at; power = script(); }
        else if (/^'+$/.test(words[at] || '')) {
          primes += '′'.repeat(words[at++].length);
        } else break;
      }
      if (primes) {  // fonts raise them, as a superscript they would fly off
        const primed = make('mrow');
        if (index) { const indexed = make('msub'); indexed.append(base, index); base = indexed; index = null; }
        primed.append(base, make('mi', null, primes));
        base = primed;
      }
      if (!index && !power) return base;
      const made = make(index && power ? 'msubsup' : index ? 'msub' : 'msup');
      made.append(...[base, index, power].filter(Boolean));
      return made;
    };
    // As tall as a letter: all stands on one line.
    const fence = (sign) => { const made = make('mo', null, sign); made.setAttribute('stretchy', 'false'); return made; };
    const bracketed = (open, close) => {
      const made = make('mrow'), inside = row(close);
      made.append(fence(open), inside, fence(close));
      return made;
    };
    function one() {
      const word = words[at++];
      if (word === '(') return dressed(bracketed('(', ')'));
      if (word === '|') return dressed(bracketed('|', '|'));
      if (/^\d/.test(word)) return dressed(make('mn', null, word));
      if (is_word(word)) {
        if ((word === 'abs' || word === 'sqrt') && words[at] === '(') {
          ++at;
          const made = make(word === 'abs' ? 'mrow' : 'msqrt'), inside = row(')');
          if (word === 'abs') made.append(fence('|'), inside, fence('|'));
          else made.appendChild(inside);
          return dressed(made);
        }
        const base = symbol(word);
        const plain = word.length > 1 && !greek[word] && !functions.includes(word) && word !== 'sum' && word !== 'Int' && words[at] !== '_' && words[at] !== '^';
        const made = dressed(base);
        if (!plain) return made;
        const words_here = make('mrow');  // a word of a sentence keeps its distance
        words_here.append(make('mtext', null, '\u2009'), made, make('mtext', null, '\u2009'));
        return words_here;
      }
      if (/^[\s*]+$/.test(word)) return make('mtext', null, '\u2009');
      return make('mo', null, operators[word] || word);
    }
    function row(end) {
      const made = make('mrow');
      while (at < words.length && words[at] !== end) made.appendChild(one());
      if (at < words.length) ++at;
      return made;
    }
    const math = make('math');
    math.setAttribute('display', 'inline');
    math.setAttribute('aria-label', text);
    skip();
    while (at < words.length) math.appendChild(one());
    return math;
  }
  return {set};
})();
