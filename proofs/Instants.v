(** Closed regions and continuous paths: the letter at an instant of change.

    [P r t]: at time t the robot is in region r, a closed set of times. *)

Require Import Reals Lra.
Open Scope R_scope.

Definition closed (P : R -> Prop) : Prop :=
  forall t, (forall d, 0 < d -> exists x, Rabs (x - t) < d /\ P x) -> P t.

Definition just_before (P : R -> Prop) (t : R) : Prop :=
  exists d, 0 < d /\ forall x, t - d < x < t -> P x.
Definition just_after (P : R -> Prop) (t : R) : Prop :=
  exists d, 0 < d /\ forall x, t < x < t + d -> P x.

Lemma closed_before : forall P t, closed P -> just_before P t -> P t.
Proof.
  intros P t C (e & He & H); apply C; intros d Hd.
  pose proof (Rmin_l d e); pose proof (Rmin_r d e).
  assert (0 < Rmin d e) by (apply Rmin_glb_lt; auto).
  exists (t - Rmin d e / 2); split; [|apply H; lra].
  replace (t - Rmin d e / 2 - t) with (- (Rmin d e / 2)) by ring.
  rewrite Rabs_Ropp, Rabs_right; lra.
Qed.

Lemma closed_after : forall P t, closed P -> just_after P t -> P t.
Proof.
  intros P t C (e & He & H); apply C; intros d Hd.
  pose proof (Rmin_l d e); pose proof (Rmin_r d e).
  assert (0 < Rmin d e) by (apply Rmin_glb_lt; auto).
  exists (t + Rmin d e / 2); split; [|apply H; lra].
  replace (t + Rmin d e / 2 - t) with (Rmin d e / 2) by ring.
  rewrite Rabs_right; lra.
Qed.

(** At an instant of change the letter holds what was shown before and what is shown
    after.  So each step, to the instant's letter and from it, only grows or only shrinks. *)
Theorem instant_letter : forall (Region : Type) (P : Region -> R -> Prop) t,
  (forall r, closed (P r)) ->
  (forall r, just_before (P r) t -> P r t) /\ (forall r, just_after (P r) t -> P r t).
Proof. intros Region P t C; split; intros r; [apply closed_before | apply closed_after]; auto. Qed.
