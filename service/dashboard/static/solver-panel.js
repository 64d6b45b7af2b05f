// What the solver did and how its answer was checked.

import { command, h } from "meshcone/dom";
import { number, seconds, words } from "meshcone/format";
import { chip } from "meshcone/job-words";
import { logPlot } from "meshcone/plot";

const METHODS = { relaxation: "no cone needed", multipliers: "dual method", scs: "SCS" };
const RESIDUALS = [["primal", "primal: largest violation of a cone"], ["dual", "dual: the objective's gradient is balanced"], ["gap", "gap between primal and dual objective"], ["complementarity", "complementarity: cones with a multiplier touch their bound"]];

const total = (counts) => Object.values(counts ?? {}).reduce((sum, count) => sum + count, 0);

const kinds = (counts) => Object.entries(counts ?? {}).filter(([, count]) => count > 0).map(([kind, count]) => `${number(count)} ${words(kind)}`).join(", ");

function rounds(solver) {
  const rows = solver.rounds.map((round) => h("tr", null,
    h("th", { scope: "row" }, String(round.round)),
    h("td", { title: round.method }, METHODS[round.method] ?? round.method),
    h("td", { class: "number" }, number(round.sizes?.variables)),
    h("td", { class: "number" }, number(round.sizes?.constraints)),
    h("td", { class: "number", title: kinds(round.sizes?.cones) }, round.sizes ? number(total(round.sizes.cones)) : "–"),
    h("td", { class: "number" }, number(round.sizes?.nnz_A)),
    h("td", { class: "number" }, number(round.sizes?.nnz_P)),
    h("td", { class: "number", title: kinds(round.active_cones) }, number(total(round.active_cones))),
    h("td", { class: "number" }, round.info ? number(round.info.iterations) : "–"),
    h("td", { class: "number" }, number(round.movement)),
    h("td", { class: "number" }, seconds(round.seconds))));
  const heads = ["Round", "Solved by", "Variables", "Rows", "Cones", "nnz A", "nnz P", "Active", "SCS steps", "Moved", "Time"];
  return h("div", { class: "scroll rounds", tabindex: "0", role: "region", "aria-label": "Rounds" }, h("table", null,
    h("thead", null, h("tr", null, heads.map((head, index) => h("th", { scope: "col", class: index > 1 ? "number" : "" }, head)))),
    h("tbody", null, rows)));
}

function residualPlot(solver, tolerance) {
  const asked = solver.rounds.filter((round) => (round.history.iter ?? []).length > 0);
  if (!asked.length) return h("p", { class: "hint" }, "SCS was not asked, so there are no iterations to plot.");
  const last = asked.at(-1);
  // Iterations are counted from 0, which a logarithm has no place for.
  const x = last.history.iter.map((iteration) => iteration + 1);
  const line = (name, column) => ({ name, x, y: last.history[column].map(Math.abs) });
  const single = x.length === 1 ? " It began at the optimum and found nothing to improve." : "";
  return [
    logPlot([line("primal residual", "res_pri"), line("dual residual", "res_dual"), line("gap", "gap")], {
      label: `SCS residuals over ${x.at(-1)} iterations of round ${last.round}`, xTitle: "iteration", level: { value: tolerance, name: "tolerance" },
    }),
    h("p", { class: "hint" }, `SCS in round ${last.round}: ${last.info?.status ?? ""}, linear solver ${last.info?.linear_solver ?? "–"}.${single}`),
  ];
}

function certificateTable(certificate) {
  const cell = (value) => h("td", { class: `number ${value <= certificate.tolerance ? "better" : "worse"}` }, number(value));
  return h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": "Residuals of the certificate" }, h("table", null,
    h("thead", null, h("tr", null, h("th", { scope: "col" }, "Residual"), h("th", { scope: "col", class: "number" }, "At the optimum"), h("th", { scope: "col", class: "number" }, "As written"))),
    h("tbody", null, RESIDUALS.map(([key, text]) => h("tr", null, h("th", { scope: "row" }, text), cell(certificate.optimum[key]), h("td", { class: "number soft" }, number(certificate.written[key])))))));
}

function certificateCard(report, files) {
  const { certificate } = report;
  if (!certificate) {
    return h("section", { class: "card", "aria-labelledby": "certificate-title" }, h("h2", { id: "certificate-title" }, "Certificate"), h("p", { class: "soft" }, "It is about closeness at most: the input was kept as it was, or no round was asked for."));
  }
  const holds = certificate.relaxation_is_optimal
    ? "No cone is active: the optimum without constraints satisfies all of them, and so is the optimum with them."
    : `${number(total(certificate.active))} of ${number(total(certificate.cones))} cones hold the mesh (${kinds(certificate.active)}).`;
  return h("section", { class: "card", "aria-labelledby": "certificate-title" },
    h("div", { class: "row heading" }, h("h2", { id: "certificate-title" }, "Certificate"), chip(certificate.holds ? "pass" : "fail", certificate.holds ? "holds" : "does not hold")),
    h("p", { class: "soft" }, `${holds} Recomputed from round ${certificate.round}'s program without a solver; none may exceed ${number(certificate.tolerance)}.`),
    certificateTable(certificate),
    h("h3", null, files.apart ? "Check it yourself, with a folder for each side" : "Check it yourself, with these files beside each other"),
    command(`meshcone verify ${quoted(files.report)} --source ${quoted(files.source)} --reference ${quoted(files.reference)} --refined ${quoted(files.refined)}`, "Command that verifies the certificate"));
}

/** A file name as a shell takes it. */
export const quoted = (text) => (/^[\w./:=@%+-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`);

/** The panel of a refinement: rounds and residuals beside the certificate. */
export function solverPanel(report, files) {
  const { solver, options } = report;
  const facts = [
    ["Formulation", `${solver.formulation}, ${solver.form} form`],
    ["Effort", `${solver.effort}; kept: ${solver.candidate}`],
    ["Confirmed by SCS", solver.confirmed ? `yes, in ${seconds(solver.confirm_seconds)}` : "no"],
    ["Moved", `mean ${number(report.displacement.mean * report.frame.radius)}, at most ${number(report.displacement.max * report.frame.radius)} model units`],
  ];
  return [
    h("section", { class: "card", "aria-labelledby": "solver-title" },
      h("h2", { id: "solver-title" }, "Solver"),
      h("dl", { class: "facts" }, facts.flatMap(([term, text]) => [h("dt", null, term), h("dd", null, text)])),
      rounds(solver)),
    h("div", { class: "columns" },
      h("section", { class: "card", "aria-labelledby": "residuals-title" },
        h("h2", { id: "residuals-title" }, "Residuals of SCS"),
        residualPlot(solver, options.solver.tolerance)),
      certificateCard(report, files)),
  ];
}
