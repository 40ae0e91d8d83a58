// The dashboard of a Posefuse room: a pure client of the gRPC service posefuse.v1.Room.

import { render } from "preact";
import { startLive } from "./state/live";
import { startPlan } from "./state/plan";
import { startPrefs } from "./state/prefs";
import { startHarms } from "./state/sensors";
import { startSinkRates } from "./state/sinks";
import { startSpeech } from "./state/speech";
import { startSpots } from "./state/spots";
import { startTitle } from "./state/title";
import { App } from "./ui/App";
import { startKeys } from "./ui/keys";
import "./styles/theme.css";
import "./styles/layout.css";
import "./styles/parts.css";
import "./styles/view.css";
import "./styles/weights.css";
import "./styles/wizard.css";
import "./styles/calibrations.css";
import "./styles/depth.css";
import "./styles/plan.css";
import "./styles/outputs.css";

startPrefs();
startKeys();
startLive();
startTitle();
startHarms();
startSinkRates();
startSpots();
startSpeech();
startPlan();
render(<App />, document.getElementById("app")!);
