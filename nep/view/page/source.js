// Where the page has its data from: the server that it came from, or the file that it is saved in.

const MOST_KEPT = 300;  // answers of the server

class Source {
  constructor(page) {
    this.saved = page.saved;
    this.names = this.saved ? this.saved.names : [];
    this.plans = new Map(this.saved ? Object.entries(this.saved.plans).map(([key, plan]) => [+key, plan]) : []);
    this.kept = new Map();
    this.setRange(page);
  }

  // The steps that can be shown.
  setRange({version, first, last}) {
    if (version !== this.version) this.kept.clear();
    this.version = version;
    this.steps = this.saved ? Object.keys(this.saved.frames).map(Number)
      : Array.from({length: last - first + 1}, (_, row) => first + row);
  }

  async ask(call, values = {}) {
    const body = JSON.stringify({call, ...values});
    if (this.kept.has(body)) return this.kept.get(body);
    const version = this.version;
    const found = await fetch("/", {method: "POST", headers: {"Content-Type": "application/json"}, body});
    if (!found.ok) throw new Error(await found.text());
    const answer = await found.json();
    if (call !== "watch" && call !== "names" && version === this.version) {
      this.kept.set(body, answer);
      if (this.kept.size > MOST_KEPT) this.kept.delete(this.kept.keys().next().value);
    }
    return answer;
  }

  // What is remembered at a step, with its plan; null if there is no such step any more.
  async readState(step) {
    if (this.saved) {
      const state = this.saved.frames[step].state;
      return {...state, plan: this.plans.get(state.plan)};
    }
    const state = await this.ask("state", {step});
    if (state.problem) return null;
    if (!this.plans.has(state.plan)) this.plans.set(state.plan, await this.ask("plan", {step}));
    if (state.numNames > this.names.length) {
      const known = this.names.length;
      const names = await this.ask("names", {since: known});
      if (this.names.length === known) this.names.push(...names);
    }
    return {...state, plan: this.plans.get(state.plan)};
  }

  async readAnswer(step, words, judge) {
    if (!words || !judge) return null;
    return this.saved ? this.saved.frames[step].answers[words] : this.ask("answer", {step, words, judge});
  }

  async readTrace(words, judge) {
    if (!words) return null;
    const trace = this.saved ? this.saved.traces[words] : await this.ask("trace", {words, judge});
    return trace && !trace.problem ? trace : null;
  }

  async readChanges(step) {
    return this.saved ? this.saved.frames[step].changes : this.ask("changes", {step});
  }

  async readFurniture(step, furniture) {
    return this.saved ? this.saved.furniture[furniture] ?? [] : this.ask("furniture", {step, furniture});
  }
}
