(** The proved checkers as OCaml: `checkers.ml`, which `driver.ml` reads cases for. *)

From Coq Require Import Extraction ExtrOcamlBasic ZArith.
From LtlPlan Require Tree Regions Progression Invariant Laps.

Extraction Language OCaml.
Set Warnings "-extraction-opaque-accessed".
Extraction "checkers.ml"
  Z.add Z.mul Z.opp Tree.check_tree Regions.check_region Regions.check_nonneg Progression.satisfies
  Invariant.letter_at Invariant.permitted Invariant.read_more
  Invariant.check_invariant Invariant.check_joint Invariant.check_own
  Laps.check_laps Laps.check_own_laps Laps.check_joint_laps.
