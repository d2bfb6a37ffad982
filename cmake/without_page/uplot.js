// Built with STEADYHAND_WITH_PAGE=OFF: the report has tables, and says in place of each plot why it is not there.
function uPlot(options, data, parent) {
  parent.textContent = 'No plot: this program was built without its page (STEADYHAND_WITH_PAGE=OFF).';
}
uPlot.pxRatio = 1;
uPlot.join = (tables) => tables[0];
