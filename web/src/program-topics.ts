/** The topics of what the user's program prints, plots and draws, as kbot.messages names them. */
export const PRINTED = "/log";
export const DRAWN = "/draw";
/** Followed by the name of the plot. */
export const PLOTTED = "/plot/";
/** The level of a printed line that reports an error. */
export const ERROR = 40;
