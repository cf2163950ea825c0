/*! Observable Plot, copyright Observable, Inc.; D3, copyright Mike Bostock; interval-tree-1d and binary-search-bounds, copyright Mikola Lysenko. Licences: ISC, BSD-3-Clause, MIT. */
// Only what report.js draws with, so that the bundler leaves the rest out.
import { plot, areaY, barX, dot, gridX, gridY, line, lineY, link, ruleX, ruleY, text, tip, pointer } from "@observablehq/plot";

globalThis.Plot = { plot, areaY, barX, dot, gridX, gridY, line, lineY, link, ruleX, ruleY, text, tip, pointer };
