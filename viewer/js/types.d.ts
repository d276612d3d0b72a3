// uPlot comes as a script of its own, which defines one global name.
import uPlotClass from "../vendor/uplot/uPlot";

declare global {
  const uPlot: typeof uPlotClass;
  type uPlot = uPlotClass;
}
