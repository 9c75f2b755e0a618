import "./tokens.css";
import "./layout.css";
import "./controls.css";
import "./panels.css";
import "./displays.css";
import "./source.css";
import "./tools.css";
import "./time.css";
