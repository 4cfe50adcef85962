(** Bernstein coefficients as whole numbers: signs, and both halves of a split. *)

Require Import Reals Lra Lia ZArith List Bool.
From LtlPlan Require Import Bernstein Crossing.
Import ListNotations.

(** ** The algorithm *)

Open Scope Z_scope.

Fixpoint sums (l : list Z) : list Z :=
  match l with
  | x :: (y :: _) as r => (x + y) :: sums r
  | _ => []
  end.

(** De Casteljau at the middle, times 2^n for n the degree. *)
Fixpoint first_half_from (n : nat) (l : list Z) : list Z :=
  match n with
  | O => [hd 0 l]
  | S m => (2 ^ Z.of_nat n * hd 0 l) :: first_half_from m (sums l)
  end.

Definition degree (l : list Z) : nat := pred (length l).
Definition first_half (l : list Z) : list Z := first_half_from (degree l) l.
Definition second_half (l : list Z) : list Z := rev (first_half (rev l)).

Definition all_nonneg (l : list Z) : bool := forallb (Z.leb 0) l.
Definition all_positive (l : list Z) : bool := forallb (Z.ltb 0) l.
Definition none_positive (l : list Z) : bool := forallb (fun x => Z.leb x 0) l.

Fixpoint rising (l : list Z) : bool :=
  match l with
  | x :: (y :: _) as r => (x <=? y) && rising r
  | _ => true
  end.

(** ** Halves represent the polynomial on half of the interval *)

Open Scope R_scope.

Definition coefficient (l : list Z) (i : nat) : R := IZR (nth i l 0%Z).
Definition value (l : list Z) (s t : R) : R := bern (degree l) (coefficient l) s t.

Lemma sums_nth : forall l i, (S i < length l)%nat ->
  coefficient (sums l) i = coefficient l i + coefficient l (S i).
Proof.
  unfold coefficient; induction l as [|x [|y r] IH]; intros i H; simpl in H; try lia.
  destruct i as [|i]; [simpl; apply plus_IZR|].
  apply (IH i); simpl; lia.
Qed.

Lemma sums_length : forall l, length (sums l) = pred (length l).
Proof. induction l as [|x [|y r] IH]; auto. 
  change (length (sums (x :: y :: r))) with (S (length (sums (y :: r)))); now rewrite IH. Qed.

Lemma half_length : forall n l, length (first_half_from n l) = S n.
Proof. induction n as [|n IH]; intros; simpl; auto. Qed.

Lemma half_double : forall n l i, (i <= n)%nat ->
  coefficient (first_half_from (S n) l) i = 2 * coefficient (first_half_from n l) i.
Proof.
  unfold coefficient; induction n as [|n IH]; intros l i Hi.
  - replace i with O by lia; cbn [first_half_from nth].
    rewrite mult_IZR; f_equal.
  - destruct i as [|i].
    + cbn [first_half_from nth]; rewrite <- mult_IZR; f_equal.
      rewrite (Nat2Z.inj_succ (S n)), Z.pow_succ_r by lia; ring.
    + apply (IH (sums l) i); lia.
Qed.

Lemma half_value : forall n l s t, (n < length l)%nat ->
  bern n (coefficient (first_half_from n l)) s t = bern n (coefficient l) (2 * s + t) t.
Proof.
  induction n as [|n IH]; intros l s t H.
  - destruct l; reflexivity.
  - cbn [bern].
    rewrite (bern_ext n _ (fun i => 2 * coefficient (first_half_from n l) i))
      by (intros; apply half_double; auto).
    rewrite (bern_ext n (fun i => coefficient (first_half_from (S n) l) (S i))
      (coefficient (first_half_from n (sums l)))) by auto.
    rewrite bern_scale, !IH by (rewrite ?sums_length; lia).
    rewrite (bern_ext n (coefficient (sums l))
      (fun i => coefficient l i + coefficient l (S i))) by (intros; apply sums_nth; lia).
    rewrite bern_plus; ring.
Qed.

Lemma first_half_degree : forall l, degree (first_half l) = degree l.
Proof. intros; unfold degree at 1, first_half; now rewrite half_length. Qed.

Theorem first_half_value : forall l s t, l <> [] ->
  value (first_half l) s t = value l (2 * s + t) t.
Proof.
  intros l s t H; unfold value; rewrite first_half_degree; apply half_value.
  destruct l; [congruence | unfold degree; simpl; lia].
Qed.

Lemma rev_value : forall l s t, value (rev l) s t = value l t s.
Proof.
  intros l s t; unfold value, degree; rewrite rev_length.
  destruct l as [|x r]; [reflexivity|].
  rewrite <- bern_swap; apply bern_ext; intros i Hi; simpl in Hi.
  unfold coefficient; rewrite rev_nth by (simpl; lia); do 2 f_equal; simpl; lia.
Qed.

Theorem second_half_value : forall l s t, l <> [] ->
  value (second_half l) s t = value l s (s + 2 * t).
Proof.
  intros l s t H; unfold second_half; rewrite rev_value, first_half_value.
  - rewrite rev_value; f_equal; ring.
  - intros E; apply H; rewrite <- (rev_involutive l), E; auto.
Qed.

(** Up to a positive factor [l] represents [f] from [a] to [b]. *)
Definition represents (l : list Z) (f : R -> R) (a b : R) : Prop :=
  l <> [] /\ exists k, 0 < k /\
    forall u, 0 <= u <= 1 -> value l (1 - u) u = k * f (a + u * (b - a)).

Lemma value_scale : forall l k s t, value l (k * s) (k * t) = k ^ degree l * value l s t.
Proof. intros; apply bern_homogeneous. Qed.

Lemma half_nonempty : forall l, first_half l <> [].
Proof. intros l E; pose proof (half_length (degree l) l) as H; unfold first_half in E; rewrite E in H; discriminate. Qed.

Theorem first_represents : forall l f a b,
  represents l f a b -> represents (first_half l) f a ((a + b) / 2).
Proof.
  intros l f a b (H & k & Hk & V); split; [apply half_nonempty|].
  exists (2 ^ degree l * k); split; [apply Rmult_lt_0_compat; auto; apply pow_lt; lra|].
  intros u Hu; rewrite first_half_value by auto.
  replace (2 * (1 - u) + u) with (2 * (1 - u / 2)) by lra.
  replace u with (2 * (u / 2)) at 2 by lra.
  rewrite value_scale, V by lra; rewrite Rmult_assoc; do 3 f_equal; lra.
Qed.

Theorem second_represents : forall l f a b,
  represents l f a b -> represents (second_half l) f ((a + b) / 2) b.
Proof.
  intros l f a b (H & k & Hk & V); split.
  { intros E; apply (half_nonempty (rev l)); unfold second_half in E.
    rewrite <- (rev_involutive (first_half _)), E; auto. }
  exists (2 ^ degree l * k); split; [apply Rmult_lt_0_compat; auto; apply pow_lt; lra|].
  intros u Hu; rewrite second_half_value by auto.
  replace (1 - u + 2 * u) with (2 * ((1 + u) / 2)) by lra.
  replace (1 - u) with (2 * (1 - (1 + u) / 2)) by lra.
  rewrite value_scale, V by lra; rewrite Rmult_assoc; do 3 f_equal; lra.
Qed.

(** ** Signs on a cell *)

Lemma all_nonneg_sound : forall l f a b, a < b -> represents l f a b ->
  all_nonneg l = true -> always (fun x => 0 <= f x) a b.
Proof.
  intros l f a b Hab (_ & k & Hk & V) H x Hx.
  set (u := (x - a) / (b - a)).
  assert (Eu : a + u * (b - a) = x) by (unfold u; field; lra).
  assert (Hu : 0 <= u <= 1) by (split; apply Rmult_le_reg_r with (b - a); lra).
  specialize (V u Hu); rewrite Eu in V.
  assert (0 <= value l (1 - u) u).
  { apply bern_nonneg; try lra; intros i Hi; unfold coefficient; apply IZR_le.
    destruct (nth_in_or_default i l 0%Z) as [I | ->]; [|lia].
    unfold all_nonneg in H; rewrite forallb_forall in H; apply H in I; lia. }
  apply Rmult_le_reg_l with k; lra.
Qed.

Lemma none_positive_sound : forall l f a b, a < b -> represents l f a b ->
  none_positive l = true -> always (fun x => f x <= 0) a b.
Proof.
  intros l f a b Hab (_ & k & Hk & V) H x Hx.
  set (u := (x - a) / (b - a)).
  assert (Eu : a + u * (b - a) = x) by (unfold u; field; lra).
  assert (Hu : 0 <= u <= 1) by (split; apply Rmult_le_reg_r with (b - a); lra).
  specialize (V u Hu); rewrite Eu in V.
  assert (value l (1 - u) u <= 0).
  { apply bern_upper; try lra; intros i Hi; unfold coefficient; apply IZR_le.
    destruct (nth_in_or_default i l 0%Z) as [I | ->]; [|lia].
    unfold none_positive in H; rewrite forallb_forall in H; apply H in I; lia. }
  apply Rmult_le_reg_l with k; lra.
Qed.

Lemma all_positive_sound : forall l f a b, a < b -> represents l f a b ->
  all_positive l = true -> always (fun x => 0 < f x) a b.
Proof.
  intros l f a b Hab (NE & k & Hk & V) H x Hx.
  set (u := (x - a) / (b - a)).
  assert (Eu : a + u * (b - a) = x) by (unfold u; field; lra).
  assert (Hu : 0 <= u <= 1) by (split; apply Rmult_le_reg_r with (b - a); lra).
  specialize (V u Hu); rewrite Eu in V.
  assert (0 < value l (1 - u) u).
  { apply bern_positive; try lra; intros i Hi; unfold coefficient; apply IZR_lt.
    assert (I : In (nth i l 0%Z) l)
      by (apply nth_In; destruct l; [congruence | unfold degree in Hi; simpl in *; lia]).
    unfold all_positive in H; rewrite forallb_forall in H; apply H in I; lia. }
  apply Rmult_lt_reg_l with k; lra.
Qed.

Lemma rising_sound : forall l i, rising l = true -> (i < degree l)%nat ->
  coefficient l i <= coefficient l (S i).
Proof.
  unfold coefficient, degree; induction l as [|x [|y r] IH]; intros i H Hi; simpl in Hi; try lia.
  cbn [rising] in H; apply andb_prop in H as [Hxy Hr].
  destruct i as [|i]; [simpl; apply IZR_le; lia|].
  apply (IH i); auto; simpl; lia.
Qed.

Lemma rises_sound : forall l f a b x y, a < b -> represents l f a b -> rising l = true ->
  a <= x -> x <= y -> y <= b -> f x <= f y.
Proof.
  intros l f a b x y Hab (_ & k & Hk & V) H Hx Hxy Hy.
  set (u := (x - a) / (b - a)); set (v := (y - a) / (b - a)).
  assert (Eu : a + u * (b - a) = x) by (unfold u; field; lra).
  assert (Ev : a + v * (b - a) = y) by (unfold v; field; lra).
  assert (Hu : 0 <= u) by (apply Rmult_le_reg_r with (b - a); lra).
  assert (Huv : u <= v) by (apply Rmult_le_reg_r with (b - a); lra).
  assert (Hv : v <= 1) by (apply Rmult_le_reg_r with (b - a); lra).
  pose proof (bern_monotone (degree l) (coefficient l) u v Hu Huv Hv
    (fun i Hi => rising_sound l i H Hi)) as M.
  change (value l (1 - u) u <= value l (1 - v) v) in M.
  rewrite !V, Eu, Ev in M by lra; apply Rmult_le_reg_l with k; lra.
Qed.

Lemma represents_rev : forall l f a b, represents l f a b ->
  represents (rev l) (fun x => f (a + b - x)) a b.
Proof.
  intros l f a b (NE & k & Hk & V); split.
  { intros E; apply NE; rewrite <- (rev_involutive l), E; auto. }
  exists k; split; auto; intros u Hu; rewrite rev_value.
  replace u with (1 - (1 - u)) at 1 by ring; rewrite V by lra; do 2 f_equal; ring.
Qed.

Lemma falls_sound : forall l f a b x y, a < b -> represents l f a b -> rising (rev l) = true ->
  a <= x -> x <= y -> y <= b -> f y <= f x.
Proof.
  intros l f a b x y Hab K H Hx Hxy Hy.
  pose proof (rises_sound _ _ a b (a + b - y) (a + b - x) Hab (represents_rev _ _ _ _ K) H) as M.
  cbn in M; replace (a + b - (a + b - y)) with y in M by ring.
  replace (a + b - (a + b - x)) with x in M by ring; apply M; lra.
Qed.
