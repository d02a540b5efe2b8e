"""Does it hold, on motions that the fit did not see; how well parameters are known; what could not be seen."""
