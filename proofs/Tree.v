(** The checker of subdivision trees, over whole numbers, and its soundness.

    A body is a list of inequalities.  Each has two polynomials in time, as
    Bernstein coefficients up to a positive factor: [kept] is not negative where
    the inequality holds, [broken] is positive where it fails.  At a margin the
    two differ.  A tree in preorder says how the whole interval is cut into
    halves, and what holds on each leaf. *)

Require Import Reals Lra Lia ZArith List Bool.
From LtlPlan Require Import Bernstein Crossing.
Import ListNotations.

(** ** The algorithm *)

Open Scope Z_scope.

Record inequality := Inequality { kept : list Z; broken : list Z }.

Inductive mark := Split | Must | No (i : nat) | Cross (i : nat) | Open.

(** The part of the interval from k/2^d to (k+1)/2^d, with the body on it. *)
Record cell := Cell { place : Z; depth : nat; body : list inequality }.

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

Definition both (f : list Z -> list Z) (q : inequality) : inequality :=
  Inequality (f (kept q)) (f (broken q)).

Definition first_cell (c : cell) : cell :=
  Cell (2 * place c) (S (depth c)) (map (both first_half) (body c)).
Definition second_cell (c : cell) : cell :=
  Cell (2 * place c + 1) (S (depth c)) (map (both second_half) (body c)).

Definition all_nonneg (l : list Z) : bool := forallb (Z.leb 0) l.
Definition all_positive (l : list Z) : bool := forallb (Z.ltb 0) l.

Fixpoint rising (l : list Z) : bool :=
  match l with
  | x :: (y :: _) as r => (x <=? y) && rising r
  | _ => true
  end.

Definition comes (l : list Z) : bool := rising l && (hd 0 l <? 0) && (0 <=? last l 0).

Fixpoint others_kept (i : nat) (b : list inequality) : bool :=
  match b, i with
  | [], _ => true
  | _ :: r, O => forallb (fun q => all_nonneg (kept q)) r
  | q :: r, S j => all_nonneg (kept q) && others_kept j r
  end.

Definition holds (m : mark) (b : list inequality) : bool :=
  match m with
  | Split => false
  | Open => true
  | Must => forallb (fun q => all_nonneg (kept q)) b
  | No i => match nth_error b i with Some q => all_positive (broken q) | None => false end
  | Cross i =>
      match nth_error b i with
      | Some q => (comes (kept q) || comes (rev (kept q))) && others_kept i b
      | None => false
      end
  end.

Definition leaf : Type := mark * Z * nat.

(** Cells yet to be marked, from left to right; the marks; the leaves. *)
Fixpoint check (cells : list cell) (marks : list mark) : option (list leaf) :=
  match marks, cells with
  | [], [] => Some []
  | Split :: ms, c :: cs => check (first_cell c :: second_cell c :: cs) ms
  | m :: ms, c :: cs =>
      if holds m (body c)
      then option_map (cons (m, place c, depth c)) (check cs ms)
      else None
  | _, _ => None
  end.

Definition check_tree (b : list inequality) (marks : list mark) : option (list leaf) :=
  check [Cell 0 0 b] marks.

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

Lemma last_coefficient : forall l, coefficient l (degree l) = IZR (last l 0%Z).
Proof.
  unfold coefficient, degree; induction l as [|x [|y r] IH]; auto.
Qed.

Lemma comes_sound : forall l f a b, a < b -> represents l f a b ->
  comes l = true -> comes_once (fun x => 0 <= f x) a b.
Proof.
  intros l f a b Hab (_ & k & Hk & V) H; unfold comes in H.
  apply andb_prop in H as [H H2]; apply andb_prop in H as [H0 H1].
  destruct (crossing_in (degree l) (coefficient l)) as (z & Hz & Z).
  - intros; apply rising_sound; auto.
  - unfold coefficient; destruct l; simpl in *; apply IZR_lt; lia.
  - rewrite last_coefficient; apply IZR_le; lia.
  - exists (a + z * (b - a)); split; [nra|]; intros x Hx.
    set (u := (x - a) / (b - a)).
    assert (Eu : a + u * (b - a) = x) by (unfold u; field; lra).
    assert (Hu : 0 <= u <= 1) by (split; apply Rmult_le_reg_r with (b - a); lra).
    specialize (V u Hu); rewrite Eu in V; specialize (Z u Hu); unfold poly in Z.
    change (bern (degree l) (coefficient l) (1 - u) u) with (value l (1 - u) u) in Z.
    rewrite V in Z. transitivity (z <= u); [rewrite <- Z|]; split; intros; nra.
Qed.

Lemma represents_rev : forall l f a b, represents l f a b ->
  represents (rev l) (fun x => f (a + b - x)) a b.
Proof.
  intros l f a b (NE & k & Hk & V); split.
  { intros E; apply NE; rewrite <- (rev_involutive l), E; auto. }
  exists k; split; auto; intros u Hu; rewrite rev_value.
  replace u with (1 - (1 - u)) at 1 by ring; rewrite V by lra; do 2 f_equal; ring.
Qed.

Lemma goes_sound : forall l f a b, a < b -> represents l f a b ->
  comes (rev l) = true -> goes_once (fun x => 0 <= f x) a b.
Proof.
  intros l f a b Hab H C.
  destruct (comes_sound _ _ a b Hab (represents_rev _ _ _ _ H) C) as (z & Hz & Z).
  exists (a + b - z); split; [lra|]; intros x Hx.
  specialize (Z (a + b - x)); replace (a + b - (a + b - x)) with x in Z by ring.
  rewrite Z by lra; lra.
Qed.

(** ** The tree *)

(** The polynomials of a body as functions of the whole interval's time. *)
Definition functions : Type := list ((R -> R) * (R -> R)).

Definition stands_for (a b : R) (q : inequality) (f : (R -> R) * (R -> R)) : Prop :=
  represents (kept q) (fst f) a b /\ represents (broken q) (snd f) a b.

Definition inside (fs : functions) (x : R) : Prop := forall f, In f fs -> 0 <= fst f x.

(** What a leaf says of the body on its part of the interval. *)
Definition says (fs : functions) (m : mark) (a b : R) : Prop :=
  match m with
  | Split => False
  | Open => True
  | Must => always (inside fs) a b
  | No i => exists f, nth_error fs i = Some f /\ always (fun x => 0 < snd f x) a b
  | Cross _ => comes_once (inside fs) a b \/ goes_once (inside fs) a b
  end.

Definition start (k : Z) (d : nat) : R := IZR k / 2 ^ d.

(** The leaves follow each other from [a] to [b], and each is true. *)
Inductive tiles (fs : functions) : R -> R -> list leaf -> Prop :=
  | tiles_none : forall a, tiles fs a a []
  | tiles_leaf : forall b m k d r,
      says fs m (start k d) (start (k + 1) d) ->
      tiles fs (start (k + 1) d) b r -> tiles fs (start k d) b ((m, k, d) :: r).

(** Cells follow each other from [a] to [b], and represent the body. *)
Inductive row (fs : functions) : R -> R -> list cell -> Prop :=
  | row_none : forall a, row fs a a []
  | row_cell : forall b k d qs r,
      Forall2 (stands_for (start k d) (start (k + 1) d)) qs fs ->
      row fs (start (k + 1) d) b r -> row fs (start k d) b (Cell k d qs :: r).

Lemma pow2 : forall d, 0 < 2 ^ d.
Proof. intros; apply pow_lt; lra. Qed.

Lemma start_next : forall k d, start k d < start (k + 1) d.
Proof.
  intros; unfold start; rewrite plus_IZR; pose proof (pow2 d).
  apply Rmult_lt_compat_r; [apply Rinv_0_lt_compat; auto | lra].
Qed.

Lemma start_double : forall k d, start (2 * k) (S d) = start k d.
Proof. intros; unfold start; rewrite mult_IZR; simpl; field; pose proof (pow2 d); lra. Qed.

Lemma start_middle : forall k d,
  start (2 * k + 1) (S d) = (start k d + start (k + 1) d) / 2.
Proof.
  intros; unfold start; rewrite !plus_IZR, mult_IZR; simpl; field; pose proof (pow2 d); lra.
Qed.

Lemma kept_sound : forall a b qs fs, a < b -> Forall2 (stands_for a b) qs fs ->
  forallb (fun q => all_nonneg (kept q)) qs = true -> always (inside fs) a b.
Proof.
  intros a b qs fs Hab F; induction F as [|q f qs fs [Hq _] F IH]; intros H x Hx g Hg.
  - destruct Hg.
  - cbn in H; apply andb_prop in H as [H1 H2]; destruct Hg as [<-|Hg].
    + apply (all_nonneg_sound (kept q) (fst f) a b); auto.
    + apply (IH H2 x Hx g Hg).
Qed.

Lemma others_sound : forall a b i qs fs f, a < b -> Forall2 (stands_for a b) qs fs ->
  others_kept i qs = true -> nth_error fs i = Some f ->
  forall x, a <= x <= b -> (inside fs x <-> 0 <= fst f x).
Proof.
  intros a b i qs fs f Hab F; revert i; induction F as [|q g qs fs [Hq _] F IH];
    intros [|i] H N x Hx; try discriminate; cbn in H, N.
  - injection N as ->; pose proof (kept_sound a b qs fs Hab F H x Hx) as K.
    split; [intros I; apply I; left; auto|].
    intros P h [<-|Hh]; auto.
  - apply andb_prop in H as [H1 H2]; specialize (IH i H2 N x Hx); rewrite <- IH.
    split; intros I h Hh; [apply I; right; auto|].
    destruct Hh as [<-|Hh]; auto.
    apply (all_nonneg_sound (kept q) (fst g) a b); auto.
Qed.

Lemma paired : forall a b qs fs i q, Forall2 (stands_for a b) qs fs ->
  nth_error qs i = Some q -> exists f, nth_error fs i = Some f /\ stands_for a b q f.
Proof.
  intros a b qs fs i q F; revert i; induction F as [|p f qs fs H F IH]; intros [|i] N;
    try discriminate; cbn in *; [injection N as ->; eauto | auto].
Qed.

Lemma holds_sound : forall m qs fs a b, a < b -> Forall2 (stands_for a b) qs fs ->
  holds m qs = true -> says fs m a b.
Proof.
  intros [| | i | i |] qs fs a b Hab F H; cbn in H |- *; auto; try discriminate.
  - apply (kept_sound a b qs fs); auto.
  - destruct (nth_error qs i) as [q|] eqn:N; [|discriminate].
    destruct (paired _ _ _ _ _ _ F N) as (f & Nf & _ & Hb); exists f; split; auto.
    apply (all_positive_sound (broken q)); auto.
  - destruct (nth_error qs i) as [q|] eqn:N; [|discriminate].
    destruct (paired _ _ _ _ _ _ F N) as (f & Nf & Hk & _).
    apply andb_prop in H as [C O].
    pose proof (others_sound a b i qs fs f Hab F O Nf) as E.
    apply orb_prop in C as [C|C]; [left | right].
    + destruct (comes_sound _ _ a b Hab Hk C) as (z & Hz & Z); exists z; split; auto.
      intros x Hx; rewrite E, Z by auto; reflexivity.
    + destruct (goes_sound _ _ a b Hab Hk C) as (z & Hz & Z); exists z; split; auto.
      intros x Hx; rewrite E, Z by auto; reflexivity.
Qed.

Lemma split_row : forall fs b k d qs r,
  row fs (start k d) b (Cell k d qs :: r) ->
  row fs (start k d) b (first_cell (Cell k d qs) :: second_cell (Cell k d qs) :: r).
Proof.
  intros fs b k d qs r H; inversion H as [|b' k' d' qs' r' F R Es Eb]; subst.
  assert (E : start (2 * k + 1 + 1) (S d) = start (k + 1) d)
    by (rewrite <- (start_double (k + 1) d); f_equal; lia).
  unfold first_cell, second_cell; simpl place; simpl depth; simpl body.
  rewrite <- (start_double k d); constructor; [|constructor; rewrite E; auto];
    rewrite ?E, ?start_double, ?start_middle; clear - F; induction F; simpl; constructor; auto;
    destruct H; split; simpl; auto using first_represents, second_represents.
Qed.

Theorem check_sound : forall marks cells fs a b leaves, row fs a b cells ->
  check cells marks = Some leaves -> tiles fs a b leaves.
Proof.
  induction marks as [|m ms IH]; intros [|c cs] fs a b leaves R H; try discriminate.
  - injection H as <-; inversion R; constructor.
  - destruct m; discriminate.
  - inversion R as [|b' k d qs r F Rr]; subst.
    assert (L : forall l, holds m qs = true -> check cs ms = Some l ->
      tiles fs (start k d) b ((m, k, d) :: l)).
    { intros l Hm Hl; constructor; [|eapply IH; eauto].
      apply (holds_sound m qs); auto using start_next. }
    destruct m; cbn [check body place depth] in H;
      try (destruct (holds _ qs); [|discriminate]; destruct (check cs ms); [|discriminate];
           injection H as <-; apply L; auto).
    eapply IH; [|exact H]; apply split_row; auto.
Qed.

Theorem check_tree_sound : forall qs fs marks leaves,
  Forall2 (stands_for 0 1) qs fs -> check_tree qs marks = Some leaves ->
  tiles fs 0 1 leaves.
Proof.
  intros qs fs marks leaves F H; unfold check_tree in H.
  apply (check_sound marks [Cell 0 0 qs]); auto.
  assert (E0 : start 0 0 = 0) by (unfold start; simpl; lra).
  assert (E1 : start (0 + 1) 0 = 1) by (unfold start; simpl; lra).
  rewrite <- E0 at 1; constructor; rewrite ?E0, E1; auto; constructor.
Qed.
