(** Marks of a span: no, must, exactly one crossing, open. *)

Require Import Reals Lra Lia.
From LtlPlan Require Import Bernstein.
Open Scope R_scope.

(** ** What a mark says of a property on a span *)

Definition never (P : R -> Prop) (a b : R) : Prop := forall x, a <= x <= b -> ~ P x.
Definition always (P : R -> Prop) (a b : R) : Prop := forall x, a <= x <= b -> P x.

(** One change at [z]; P holds at the instant itself, as regions are closed. *)
Definition comes_once (P : R -> Prop) (a b : R) : Prop :=
  exists z, a <= z <= b /\ forall x, a <= x <= b -> (P x <-> z <= x).
Definition goes_once (P : R -> Prop) (a b : R) : Prop :=
  exists z, a <= z <= b /\ forall x, a <= x <= b -> (P x <-> x <= z).

Lemma comes_once_ends : forall P a b z, a < z <= b ->
  (forall x, a <= x <= b -> (P x <-> z <= x)) -> ~ P a /\ P b.
Proof. intros P a b z Hz H; split; rewrite H; lra. Qed.

(** ** A property that stays once it holds *)

Lemma least_point : forall (P : R -> Prop) a b, a <= b ->
  (forall x, P x \/ ~ P x) -> ~ P a -> P b ->
  (forall x y, a <= x -> x <= y -> y <= b -> P x -> P y) ->
  exists z, a <= z <= b
    /\ (forall x, a <= x -> x < z -> ~ P x) /\ (forall x, z < x -> x <= b -> P x).
Proof.
  intros P a b Hab Dec Na Pb Up.
  set (E := fun x => a <= x <= b /\ ~ P x).
  destruct (completeness E) as [z [Hub Hleast]].
  - exists b; intros x [Hx _]; lra.
  - exists a; split; [lra | auto].
  - assert (Hz : a <= z <= b).
    { split; [apply Hub; split; [lra | auto] | apply Hleast; intros x [Hx _]; lra]. }
    exists z; split; [auto | split].
    + intros x Ha Hx Px.
      assert (z <= x); [|lra].
      apply Hleast; intros y [Hy Ny]; destruct (Rle_lt_dec y x); auto.
      exfalso; apply Ny, (Up x y); lra || auto.
    + intros x Hx Hb; destruct (Dec x) as [|N]; auto.
      assert (x <= z) by (apply Hub; split; [lra | auto]); lra.
Qed.

(** ** Polynomials whose derivative has one sign *)

Definition poly (n : nat) (b : nat -> R) (x : R) : R := bern n b (1 - x) x.

Lemma poly_continuous : forall n b x, continuity_pt (poly n b) x.
Proof.
  assert (L : forall x, continuity_pt (fun x => 1 - x) x)
    by (intros x; apply continuity_pt_minus;
        [apply continuity_pt_const; intros ? ?; auto | apply derivable_continuous_pt, derivable_pt_id]).
  induction n as [|n IH]; intros b x.
  - apply continuity_pt_const; intros ? ?; auto.
  - apply (continuity_pt_plus (fun x => (1 - x) * poly n b x) (fun x => x * poly n (fun i => b (S i)) x));
      apply continuity_pt_mult; auto.
    apply derivable_continuous_pt, derivable_pt_id.
Qed.

(** Where a continuous function is negative it is so a little further. *)
Lemma negative_nearby : forall f x, continuity_pt f x -> f x < 0 ->
  exists d, 0 < d /\ forall y, Rabs (y - x) < d -> f y < 0.
Proof.
  intros f x C N; destruct (C (- f x)) as (d & Hd & H); [lra|].
  exists d; split; auto; intros y Hy.
  destruct (Req_dec x y) as [->|NE]; auto.
  assert (B : Rabs (f y - f x) < - f x) by (apply (H y); repeat split; auto).
  apply Rabs_def2 in B; lra.
Qed.

Lemma poly_ends : forall n b, poly n b 0 = b O /\ poly n b 1 = b n.
Proof.
  intros n b; unfold poly; split; rewrite ?Rminus_0_r, ?Rminus_diag_eq; auto.
  - revert b; induction n as [|n IH]; intros b; simpl; [auto | rewrite !IH; ring].
  - revert b; induction n as [|n IH]; intros b; simpl; [auto|].
    rewrite (IH (fun i => b (S i))); ring.
Qed.

Theorem crossing_in : forall n b,
  (forall i, (i < n)%nat -> b i <= b (S i)) -> b O < 0 -> 0 <= b n ->
  comes_once (fun x => 0 <= poly n b x) 0 1.
Proof.
  intros n b Up N P; destruct (poly_ends n b) as [E0 E1].
  destruct (least_point (fun x => 0 <= poly n b x) 0 1) as (z & Hz & Lo & Hi); try lra.
  - intros x; destruct (Rle_lt_dec 0 (poly n b x)); lra.
  - intros x y Hx Hxy Hy Px; pose proof (bern_monotone n b x y Hx Hxy Hy Up).
    unfold poly in *; lra.
  - exists z; split; auto; intros x Hx; split.
    + intros Px; destruct (Rle_lt_dec z x); auto. exfalso; apply (Lo x); lra.
    + intros Hzx; destruct (Req_dec z x) as [<-|]; [|apply Hi; lra].
      apply Rnot_lt_le; intros Neg.
      destruct (negative_nearby (poly n b) z (poly_continuous n b z) Neg) as (d & Hd & Near).
      destruct (Req_dec z 1) as [->|]; [lra|].
      set (y := Rmin 1 (z + d / 2)).
      assert (z < y) by (unfold y; apply Rmin_glb_lt; lra).
      assert (y <= 1) by apply Rmin_l. assert (y <= z + d / 2) by apply Rmin_r.
      assert (0 <= poly n b y) by (apply Hi; lra).
      assert (poly n b y < 0) by (apply Near; rewrite Rabs_right; lra). lra.
Qed.

Theorem crossing_out : forall n b,
  (forall i, (i < n)%nat -> b (S i) <= b i) -> 0 <= b O -> b n < 0 ->
  goes_once (fun x => 0 <= poly n b x) 0 1.
Proof.
  intros n b Down P N.
  destruct (crossing_in n (fun i => b (n - i)%nat)) as (z & Hz & H).
  - intros i Hi; replace (n - i)%nat with (S (n - S i)) by lia; apply Down; lia.
  - now rewrite Nat.sub_0_r.
  - now rewrite Nat.sub_diag.
  - exists (1 - z); split; [lra|]; intros x Hx; specialize (H (1 - x)).
    unfold poly in *; rewrite bern_swap in H.
    replace (1 - (1 - x)) with x in H by ring.
    assert (0 <= 1 - x <= 1) by lra; apply H in H0; rewrite H0; lra.
Qed.
