// SPDX-License-Identifier: Apache-2.0
// The page of a live session. It displays views and events, and sends commands. All text is inserted as
// text, never as markup.
import { makeGuidedCube } from "./guided_cube.js";
import { makeSphere } from "./sphere.js";
import { makeTraces } from "./traces.js";

const at = (id) => document.getElementById(id);
const face = (name) => name.replace("-", "\u2212");
// Replaces the hyphen before numbers and faces by a minus sign.
const minus = (text) => text.replace(/(^|[\s(,=])-(?=[\d.]|[XYZxyz]\b)/g, "$1\u2212");
const WORDS = {
  capture: "Take reading", accept: "Accept reading", "as-seen": "Accept recognised pose", retake: "Retake last",
  "retake-suggested": "Retake suspects", undo: "Undo", skip: "Skip", replicate: "Repeat all points",
  pause: "Pause", "go-on": "Go on", finish: "Finish", automatic: "Automatic on/off", quit: "Stop",
};
const GRAVE = new Set(["quit"]);
const FIRST = new Set(["capture", "accept", "go-on", "retake-suggested", "finish"]);

const cube = makeGuidedCube(at("cube"));
const sphere = makeSphere(at("sphere"));
const traces = makeTraces(at("trace"), at("noise"));
let audio = null;
let controls = false;
let alive = 0;

function tone(frequency, length, when = 0) {
  if (!audio) {
    return;
  }
  const oscillator = audio.createOscillator();
  const gain = audio.createGain();
  oscillator.frequency.value = frequency;
  gain.gain.setValueAtTime(0.25, audio.currentTime + when);
  gain.gain.exponentialRampToValueAtTime(0.001, audio.currentTime + when + length);
  oscillator.connect(gain).connect(audio.destination);
  oscillator.start(audio.currentTime + when);
  oscillator.stop(audio.currentTime + when + length);
}

const SOUNDS = {
  captured: () => [tone(880, 0.15), tone(1320, 0.3, 0.15)],
  question: () => [tone(220, 0.3), tone(180, 0.5, 0.3)],
  as_before: () => tone(220, 0.3),
  knock: () => tone(330, 0.2),
  drift: () => tone(330, 0.2),
  alarm: () => [tone(440, 0.15), tone(440, 0.15, 0.25), tone(440, 0.15, 0.5)],
  review: () => [tone(660, 0.2), tone(880, 0.2, 0.2), tone(1320, 0.4, 0.4)],
};

at("sound").addEventListener("click", () => {
  if (audio) {
    audio.close();
    audio = null;
  } else {
    audio = new AudioContext();
    tone(880, 0.15);
  }
  at("sound").setAttribute("aria-pressed", String(Boolean(audio)));
  at("sound").textContent = audio ? "Sound on" : "Sound off";
});

async function post(path, body) {
  try {
    const response = await fetch(path, {
      method: "POST",
      headers: { "Content-Type": "application/json", "X-Axiscal": "1" },
      body: JSON.stringify(body),
    });
    return response.ok ? null : ((await response.json()).error ?? "refused");
  } catch {
    return "the session cannot be reached";
  }
}

function say(text) {
  const line = document.createElement("li");
  line.textContent = minus(text);
  at("log").prepend(line);
  while (at("log").children.length > 12) {
    at("log").lastChild.remove();
  }
}

async function send(command) {
  const error = await post("/command", { command });
  if (error) {
    say(error);
  }
}

at("control").addEventListener("click", async () => {
  const error = await post("/control", {});
  if (error) {
    say(error);
  }
});

// True if the new data of a part of the page differ from the data that it displays.
const shown = {};
function isNews(part, what) {
  const key = JSON.stringify(what);
  const news = shown[part] !== key;
  shown[part] = key;
  return news;
}

function showActions(actions) {
  if (!isNews("actions", [actions, controls])) {
    return;
  }
  const focused = document.activeElement?.dataset?.action;
  at("actions").replaceChildren(
    ...actions.map((action, index) => {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = WORDS[action] ?? action;
      button.dataset.action = action;
      button.disabled = !controls;
      button.className = GRAVE.has(action) ? "grave" : index === 0 && FIRST.has(action) ? "first" : "";
      let asked = false;
      button.addEventListener("click", () => {
        if (action === "quit" && !asked) {
          asked = true;
          button.textContent = "Really stop?";
          setTimeout(() => {
            asked = false;
            button.textContent = WORDS.quit;
          }, 4000);
          return;
        }
        send(action);
      });
      return button;
    }),
  );
  at("actions").querySelector(`[data-action="${focused}"]`)?.focus();
}

function showSteps(view) {
  if (!isNews("steps", [view.steps, view.suspects])) {
    return;
  }
  let next = true;
  at("steps").replaceChildren(
    ...view.steps.map((step) => {
      const item = document.createElement("li");
      item.textContent = `${face(step.rest)} ${face(step.fence)}`;
      if (step.run !== null) {
        item.className = view.suspects.includes(step.run) ? "suspect" : "done";
        item.title = `run ${step.run}`;
        item.textContent += " \u2713";
      } else if (step.skipped) {
        item.className = "skipped";
      } else if (next) {
        item.className = "next";
        next = false;
      }
      return item;
    }),
  );
}

const set = (id, text) => {
  if (at(id).textContent !== text) {
    at(id).textContent = text;
  }
};

function duration(seconds) {
  return seconds === null ? "" : seconds < 90 ? `${Math.round(seconds)} s` : `${Math.round(seconds / 60)} min`;
}

function showRing(view) {
  const dwelling = view.phase === "dwelling" || view.phase === "ready";
  const isStill = view.stillness !== null && view.stillness <= 1;
  const share = dwelling ? view.progress : isStill ? 0 : Math.min(1, Math.log10(Math.max(1, view.stillness ?? 1)) / 3);
  at("ring").classList.toggle("moving", !isStill);
  at("arc").style.strokeDashoffset = String(314.16 * (1 - share));
  set("ring-text", dwelling ? `${Math.round(100 * view.progress)} %` : isStill ? "still" : "moving");
  set("ring-more", dwelling ? `of ${view.dwell.toPrecision(2)} s` : isStill ? "" : `${Math.min(9999, Math.round(view.stillness ?? 0))} \u00d7 limit`);
  at("ring").setAttribute("aria-label", at("ring-text").textContent);
}

function showAlarms(alarms) {
  if (!isNews("alarms", alarms)) {
    return;
  }
  at("alarms").replaceChildren(
    ...alarms.map((alarm) => {
      const line = document.createElement("p");
      line.dataset.code = alarm.code;
      line.textContent = alarm.text;
      return line;
    }),
  );
}

const element = (tag, text, more = {}) => Object.assign(document.createElement(tag), { textContent: text, ...more });

function tableOf(outcome) {
  const table = document.createElement("table");
  const row = (cells, tag) => {
    const line = document.createElement("tr");
    line.append(...cells.map((text, i) => element(i === 0 ? "th" : tag, minus(text))));
    return line;
  };
  table.append(row(outcome.head, "th"), ...outcome.rows.map((cells) => row(cells, "td")));
  return table;
}

function showOutcomes(outcomes) {
  if (isNews("outcomes", outcomes)) {
    at("outcomes").replaceChildren(
      ...outcomes.flatMap((outcome) => [
        element("p", `${outcome.slot ? `Slot ${outcome.slot}: ` : ""}${outcome.verdict}`, { className: `verdict ${outcome.status}` }),
        tableOf(outcome),
      ]),
    );
  }
}

// Shows the output files of the session and the choices after the end.
function showFiles(files) {
  if (!isNews("files", [files, controls])) {
    return;
  }
  at("files").hidden = files.length === 0;
  at("file-links").replaceChildren(
    ...files.map(({ name, label }) => {
      const item = document.createElement("li");
      item.append(element("a", label, { href: `/files/${encodeURIComponent(name)}`, target: "_blank", rel: "noopener" }));
      return item;
    }),
  );
  const wish = (text, what, className) => {
    const button = element("button", text, { type: "button", className, disabled: !controls });
    button.dataset.wish = what;
    button.addEventListener("click", async () => {
      finished = what === "leave";
      const error = await post("/wish", { wish: what });
      if (error) {
        say(error);
      }
    });
    return button;
  };
  at("wishes").replaceChildren(wish("New session, same instrument", "again", ""), wish("Close", "leave", "first"));
}

// Lines of the result that repeat the verdict. The page shows the verdict already.
const SAID = new Set(["calibrated", "calibrated, with warnings", "refused"]);

function showResult(lines) {
  if (!isNews("result", lines)) {
    return;
  }
  at("result").hidden = lines.length === 0;
  at("result-lines").replaceChildren(
    ...lines.filter((text) => !SAID.has(text)).map((text) => element("li", minus(text))),
  );
}

function show(message) {
  const view = message.view;
  controls = message.controls;
  at("control").hidden = controls;
  set("title", message.title);
  if (!view) {
    return;
  }
  document.body.dataset.phase = view.phase;
  document.body.dataset.done = String(view.done);
  set("headline", minus(view.headline));
  set("detail", minus(view.detail));
  set("rest", view.wanted ? `${face(view.wanted.rest)} on the table` : "");
  set("fence", view.wanted ? `${face(view.wanted.fence)} at the fence` : "");
  set("reading", minus(view.reading.map((v) => v.toPrecision(6)).join("  ")));
  set("rate", view.rate > 0 ? view.rate.toPrecision(4) : "");
  at("temperature-line").hidden = view.temperature === null;
  set("temperature", view.temperature === null ? "" : view.temperature.toFixed(2));
  const s = view.slope;
  set("slope", s ? minus(`${(1e3 * s.x).toFixed(2)}, ${(1e3 * s.y).toFixed(2)} mrad (\u00b1 ${(2e3 * Math.max(s.u_x, s.u_y)).toFixed(2)})`) : "");
  set("forecast", view.forecast_deg === null ? "" : `${view.forecast_deg.toPrecision(2)}\u00b0`);
  set("remaining", view.free ? "" : `${view.left} of ${view.done + view.left} points${view.remaining === null ? "" : `, ${duration(view.remaining)}`}`);
  showResult(view.result);
  showOutcomes(view.outcomes);
  showFiles(message.files);
  traces.add(view);
  set("why", whyItWaits(view));
  showRing(view);
  showAlarms(view.alarms);
  showSteps(view);
  showActions(view.actions);
  showFree(view.free, message);
  cube.show(view);
  for (const event of message.events) {
    say(event.text);
    SOUNDS[event.event]?.();
  }
}

const percent = (share) => `${Number((100 * share).toPrecision(2))} %`;

// Displays a session without a cube: the sphere and its numbers.
function showFree(free, message) {
  document.body.classList.toggle("free", Boolean(free));
  if (!free) {
    return;
  }
  sphere.take(free, message.from, message.points);
  const lines = [
    ["Readings", String(free.count)],
    ["Sphere filled", percent(free.coverage)],
    ["Largest gap", free.count > 0 ? `${Math.round((free.largest_gap_rad * 180) / Math.PI)}\u00b0` : ""],
    ["Fit error", free.fit_error === null ? "" : percent(free.fit_error)],
    ["Uncertainty (95 %)", free.u_deg === null ? "not yet known" : `${Number(free.u_deg.toPrecision(2))}\u00b0, target ${free.wanted_deg}\u00b0`],
    ...free.numbers,
  ];
  if (isNews("numbers", lines)) {
    at("free-numbers").replaceChildren(
      ...lines.map(([name, value]) => {
        const line = document.createElement("div");
        line.append(element("dt", name), element("dd", minus(value)));
        return line;
      }),
    );
  }
}
window.axiscalSphere = sphere; // for tests

// Describes the two traces in words.
function whyItWaits(view) {
  if (view.stillness === null || (view.free && view.phase !== "dwelling") || view.phase === "over" || view.phase === "review") {
    return "";
  }
  const times = view.stillness >= 10 ? Math.round(view.stillness) : view.stillness.toPrecision(2);
  return view.stillness > 1
    ? `Waiting: the noise is ${Math.min(9999, times)} times the limit of stillness`
    : view.phase === "dwelling"
      ? `Still; averaging for ${view.dwell.toPrecision(2)} s`
      : "Still";
}

let finished = false;
let source = null;
function setLink(text, lost) {
  set("link", text);
  at("link").classList.toggle("lost", lost);
}

let again = 0;
function watch() {
  clearTimeout(again);
  source?.close();
  source = new EventSource("/events");
  source.addEventListener("open", () => setLink("connected", false));
  source.addEventListener("message", (event) => {
    alive = performance.now();
    setLink("connected", false);
    show(JSON.parse(event.data));
    document.documentElement.dataset.ready = "yes";
  });
  source.addEventListener("error", () => {
    if (finished) {
      source.close();
      setLink("the session is over", false);
    } else if (source.readyState === EventSource.CLOSED) {
      // The server refused the stream. The page tries again, because the browser does not.
      setLink("not connected: open the address that the terminal shows", true);
      again = setTimeout(watch, 2000);
    } else {
      setLink("connection lost; trying again. The session goes on", true);
    }
  });
}

// Reconnects if no message arrives for a while, because browsers may detect a dead connection late.
setInterval(() => {
  if (source && !finished && performance.now() - alive > 6000 && alive > 0 && !document.hidden) {
    setLink("no data arrive any more; trying again", true);
    alive = performance.now();
    watch();
  }
}, 1000);

// Sends heartbeats. A silent page lends its control to another page and gets it back with the next heartbeat.
// A page also sends one when it becomes visible, because browsers slow down the timers of hidden pages.
const sayAlive = () => !finished && post("/alive", {});
setInterval(sayAlive, 2000);
addEventListener("visibilitychange", () => !document.hidden && sayAlive());

async function enter() {
  const key = location.hash.slice(1);
  if (key && !(await post("/login", { key }))) {
    history.replaceState(null, "", "/");
  }
  watch();
}
enter();
