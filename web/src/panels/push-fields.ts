import type { Vector3 } from "three";

import type { App } from "../app";
import { h } from "../dom";

/** Defaults: a force of the robot's weight, which makes it slide, the duration in s, or a speed in m/s. */
const WEIGHTS = 9.81;
const LASTING = 0.2;
const SPEED = 0.5;
/** Limits of the fields in N and m/s. */
const [STRONGEST, FASTEST] = [1000, 100];

/** Fields for a push (a force for a duration) or a kick (an immediate change of speed). */
export class PushFields {
  private readonly how = h(
    "select",
    { "aria-label": "Push or kick" },
    h("option", { value: "push" }, "Push"),
    h("option", { value: "kick" }, "Kick"),
  );
  private readonly strength = h("input", {
    type: "number",
    min: 0,
    step: "any",
    required: true,
    "aria-label": "Strength",
  });
  private readonly unit = h("span", { class: "unit" });
  private readonly seconds = h("input", {
    type: "number",
    min: 0.001,
    max: 10,
    step: "any",
    value: LASTING,
    required: true,
    "aria-label": "Duration of the push in seconds",
  });
  private readonly lasting = h(
    "span",
    { class: "for" },
    "for ",
    this.seconds,
    h("span", { class: "unit" }, "s"),
  );
  readonly element = h("span", { class: "tool-options" }, this.how, this.strength, this.unit, this.lasting);
  private wasChosen = false;

  /** `changed` is called with whether it is a kick. */
  constructor(
    private readonly app: App,
    changed: (kick: boolean) => void = () => undefined,
  ) {
    const show = (): void => {
      this.unit.textContent = this.isKick ? "m/s" : "N";
      this.strength.max = String(this.isKick ? FASTEST : STRONGEST);
      this.strength.title = this.isKick ? "Speed in m/s" : "Force in N";
      this.lasting.hidden = this.isKick;
      this.suggest();
      changed(this.isKick);
    };
    this.how.addEventListener("change", () => {
      this.wasChosen = false;
      show();
    });
    this.strength.addEventListener("input", () => (this.wasChosen = true));
    app.scene.watch(() => this.suggest());
    show();
  }

  get isKick(): boolean {
    return this.how.value === "kick";
  }

  /** Pushes a link or a body along a unit vector in the world. Only the robot can be kicked. Returns whether it was done. */
  give(name: string, isBody: boolean, direction: Vector3): boolean {
    if (!this.strength.reportValidity() || !(this.isKick || this.seconds.reportValidity())) return false;
    const { x, y, z } = direction.clone().multiplyScalar(this.strength.valueAsNumber);
    if (!this.isKick)
      this.app.send({ type: "push", link: name, x, y, z, seconds: this.seconds.valueAsNumber });
    else if (isBody) {
      this.app.refused.set({ reason: `Only the robot can be kicked. Push ${name} instead.` });
      return false;
    } else this.app.send({ type: "kick", x, y, z });
    this.app.notice.set({
      text: this.isKick
        ? `Kicked at ${this.strength.value} m/s.`
        : `Pushed ${name} with ${this.strength.value} N for ${this.seconds.value} s.`,
    });
    return true;
  }

  /** Sets the default strength, unless the user has set one. */
  private suggest(): void {
    if (this.wasChosen) return;
    const mass = this.app.scene.value?.links.reduce((sum, { inertia }) => sum + (inertia?.mass ?? 0), 0) ?? 1;
    this.strength.value = String(
      this.isKick ? SPEED : Math.min(STRONGEST, Number((WEIGHTS * mass).toPrecision(2))),
    );
  }
}
