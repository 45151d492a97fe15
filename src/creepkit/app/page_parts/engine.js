"use strict";
// What answers the page: the local server, or the functions that come with a page that stands alone.
(function (page) {
  // Asks the server; of quick questions one is under way and the latest waits, a new one ends an exact one.
  page.serverEngine = function (data, onAnswer, onProblem) {
    const client = [...crypto.getRandomValues(new Uint8Array(8))].map((b) => b.toString(16).padStart(2, "0")).join("");
    let number = 0, answered = 0, busy = false, waiting = null, exact = null;

    async function send(question, mark, signal) {
      const body = JSON.stringify({ ...question, client, number: mark });
      const response = await fetch(data.endpoint, { method: "POST", headers: { "Content-Type": "application/json" }, body, signal, cache: "no-store" });
      const answer = await response.json();
      if (answer.superseded) return;
      if (answer.error !== undefined) { onProblem(answer.error); return; }
      if (mark < answered) return; // a newer one has been drawn
      answered = mark;
      onAnswer(answer);
    }

    function failed(error) {
      if (error.name === "AbortError") return;
      onProblem(error instanceof TypeError ? "the server does not answer; start creepkit app again" : String(error.message ?? error));
    }

    // What the scripts of the page know themselves needs no way to the server and back.
    function here(question) {
      if (!page.answersAlone(data, question)) return false;
      try {
        answered = ++number;
        onAnswer({ exact: false, number, ...page.predict(data, { ...question, exact: false }) });
      } catch (error) {
        onProblem(String(error.message ?? error));
      }
      return true;
    }

    async function quick(question) {
      exact?.abort();
      exact = null;
      if (here(question)) return;
      waiting = [question, ++number];
      if (busy) return;
      busy = true;
      while (waiting !== null) {
        const [next, mark] = waiting;
        waiting = null;
        await send({ ...next, exact: false }, mark).catch(failed);
      }
      busy = false;
    }

    function precise(question) {
      exact?.abort();
      exact = new AbortController();
      send({ ...question, exact: true }, ++number, exact.signal).catch(failed);
    }

    return { quick, precise, has: () => true };
  };

  // Answers within the page.
  page.ownEngine = function (data, onAnswer, onProblem) {
    function answer(question, exact) {
      try {
        onAnswer({ exact, ...page.predict(data, { ...question, exact }) });
      } catch (error) {
        onProblem(String(error.message ?? error));
      }
    }
    const quick = (question) => answer(question, false), precise = (question) => answer(question, true);
    return { quick, precise, has: (specimen) => page.predicts(data, specimen) };
  };
})((globalThis.creepkitPage ??= {}));
