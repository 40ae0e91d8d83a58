// The page: status bar, sensors left, room in the middle, takes right.

import { planOpen } from "../state/plan";
import { calibrating, replay } from "../state/store";
import { Banners, Notices } from "./Banners";
import { CalibrationCard } from "./calibrate/Card";
import { CalibrationsDialog } from "./calibrate/Kept";
import { CalibratePanel } from "./calibrate/Panel";
import { ConfigDialog, HelpDialog } from "./Dialogs";
import { Outputs } from "./Outputs";
import { PlanPanel } from "./plan/Panel";
import { Plots } from "./Plots";
import { RecordBar } from "./RecordBar";
import { ReplayBar } from "./ReplayBar";
import { RoomView } from "./RoomView";
import { DepthDialog } from "./sensors/Depth";
import { RecalibratedDialog } from "./sensors/Recalibrated";
import { Sensors } from "./sensors/Sensors";
import { WeightsDialog } from "./sensors/Weights";
import { Takes } from "./Takes";
import { TopBar } from "./TopBar";

export function App() {
  return (
    <>
      <TopBar />
      <Banners />
      <div class="columns">
        <aside class="column left" aria-label="Sensors and calibration">
          <Sensors />
          <CalibrationCard />
        </aside>
        <main class="middle" aria-label="Room">
          <RoomView />
          {replay.value ? <ReplayBar /> : <RecordBar />}
          <Plots />
        </main>
        <aside class="column right" aria-label="Takes and outputs">
          {calibrating.value.kind !== "closed" ? (
            <CalibratePanel />
          ) : planOpen.value ? (
            <PlanPanel />
          ) : (
            <>
              <Takes />
              <Outputs />
            </>
          )}
        </aside>
      </div>
      <Notices />
      <HelpDialog />
      <ConfigDialog />
      <CalibrationsDialog />
      <WeightsDialog />
      <RecalibratedDialog />
      <DepthDialog />
    </>
  );
}
