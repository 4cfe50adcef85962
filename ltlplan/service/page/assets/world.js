// A mission's world as it is written, before anything is planned.
import { RING_WORDS, Scene } from "ltlplan_scene";

export default {
  template: `
<div>
  <div class="holder small" ref="holder" role="group" :aria-label="label"></div>
  <p class="ring-words">{{ ringWords }}</p>
</div>`,
  props: { figure: Object, label: String },
  data: () => ({ ringWords: RING_WORDS }),
  watch: { figure() { this.put(); } },
  mounted() { this.scene3d = new Scene(this.$refs.holder); this.put(); },
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
