// A mission's world as it is written, before anything is planned.
import { Scene } from "ltlplan_scene";

export default {
  template: `<div class="holder small" role="group" :aria-label="label"></div>`,
  props: { figure: Object, label: String },
  watch: { figure() { this.put(); } },
  mounted() { this.scene3d = new Scene(this.$el); this.put(); },
  beforeUnmount() { this.scene3d.dispose(); },
  methods: {
    put() {
      if (!this.figure) return;
      const robots = this.figure.robots || [];
      this.scene3d.show(this.figure, robots, null, this.figure.radii);
      for (const robot of this.scene3d.robots) robot.drop.scale.z = Math.max(robot.body.position.z - this.scene3d.low.z, 1e-3);
    },
  },
};
