(** Trees of rules: what a mark claims is, of some alternative, all clauses, of each some atom.

    A form is a polynomial in time, whole numbers over a unit.  An atom compares a form with
    a rational number. *)

Require Import Reals Lra Lia ZArith List Bool.
From LtlPlan Require Import Bernstein Crossing Halves Tree Regions.
Import ListNotations.

(** ** The algorithm *)

Record form := Form { row : list Z; unit : Z }.

(** Form [number] is at least num / den, or above it; [turned]: at most, or below. *)
Record atom := Atom { number : nat; strict : bool; turned : bool; num : Z; den : Z }.

(** Alternatives, of clauses, of atoms. *)
Definition rule : Type := list (list (list atom)).
Record rules := Rules { musts : rule; nos : rule }.

Definition excess (p : form) (a : atom) (n : Z) : Z :=
  let d := (n * den a - num a * unit p)%Z in if turned a then (- d)%Z else d.

Definition atom_holds (c : list form) (a : atom) : bool :=
  match nth_error c (number a) with
  | Some p => (0 <? den a)%Z && forallb (fun n => (if strict a then Z.ltb 0 else Z.leb 0) (excess p a n)) (row p)
  | None => false
  end.

Definition rule_holds (r : rule) (c : list form) : bool :=
  existsb (forallb (existsb (atom_holds c))) r.

Definition claimed (r : rules) (m : mark) (c : list form) : bool :=
  match m with
  | Must => rule_holds (musts r) c
  | No => rule_holds (nos r) c
  | Cross => false
  | Open => true
  end.

Definition first_of (p : form) : form := Form (first_half (row p)) (unit p * 2 ^ Z.of_nat (degree (row p))).
Definition second_of (p : form) : form := Form (second_half (row p)) (unit p * 2 ^ Z.of_nat (degree (row p))).

Definition check_rules (r : rules) (c : list form) (steps : list (step mark)) : option (list (leaf mark)) :=
  check_tree _ _ (map first_of) (map second_of) (claimed r) c steps.

(** ** What the marks say *)

Open Scope R_scope.

(** Exactly [f], from [a] to [b]. *)
Definition form_is (p : form) (f : R -> R) (a b : R) : Prop :=
  row p <> [] /\ (0 < unit p)%Z /\
  forall u, 0 <= u <= 1 -> value (row p) (1 - u) u = IZR (unit p) * f (a + u * (b - a)).

Lemma power_real : forall n, IZR (2 ^ Z.of_nat n) = 2 ^ n.
Proof. intros; rewrite <- pow_IZR; auto. Qed.

Lemma first_is : forall p f a b, form_is p f a b -> form_is (first_of p) f a ((a + b) / 2).
Proof.
  intros p f a b (H & U & V); unfold first_of; repeat split; cbn [row unit].
  - apply half_nonempty.
  - apply Z.mul_pos_pos; auto; apply Z.pow_pos_nonneg; lia.
  - intros u Hu; rewrite first_half_value, mult_IZR, power_real by auto.
    replace (2 * (1 - u) + u) with (2 * (1 - u / 2)) by lra.
    replace u with (2 * (u / 2)) at 2 by lra.
    rewrite value_scale, V by lra.
    replace (a + u * ((a + b) / 2 - a)) with (a + u / 2 * (b - a)) by lra; ring.
Qed.

Lemma second_is : forall p f a b, form_is p f a b -> form_is (second_of p) f ((a + b) / 2) b.
Proof.
  intros p f a b (H & U & V); unfold second_of; repeat split; cbn [row unit].
  - unfold second_half; intros E; apply (half_nonempty (rev (row p))).
    rewrite <- (rev_involutive (first_half _)), E; auto.
  - apply Z.mul_pos_pos; auto; apply Z.pow_pos_nonneg; lia.
  - intros u Hu; rewrite second_half_value, mult_IZR, power_real by auto.
    replace (1 - u + 2 * u) with (2 * ((1 + u) / 2)) by lra.
    replace (1 - u) with (2 * (1 - (1 + u) / 2)) by lra.
    rewrite value_scale, V by lra.
    replace ((a + b) / 2 + u * (b - (a + b) / 2)) with (a + (1 + u) / 2 * (b - a)) by lra; ring.
Qed.

Section Rules.
  Variable r : rules.
  (** The function of time of each form, by its number. *)
  Variable f : nat -> R -> R.

  Definition atom_true (a : atom) (x : R) : Prop :=
    let v := f (number a) x in let k := IZR (num a) / IZR (den a) in
    match turned a, strict a with
    | false, false => k <= v | false, true => k < v
    | true, false => v <= k | true, true => v < k
    end.

  Definition rule_true (q : rule) (x : R) : Prop :=
    exists way, In way q /\ forall clause, In clause way -> exists a, In a clause /\ atom_true a x.

  Definition forms_known (a b : R) (c : list form) : Prop :=
    forall k p, nth_error c k = Some p -> form_is p (f k) a b.

  Definition mark_true (m : mark) (a b : R) : Prop :=
    match m with
    | Must => always (rule_true (musts r)) a b
    | No => always (rule_true (nos r)) a b
    | Cross | Open => True
    end.

  Lemma atom_sound : forall a b c q x, a < b -> forms_known a b c -> a <= x <= b ->
    atom_holds c q = true -> atom_true q x.
  Proof.
    intros a b c q x L K X H; unfold atom_holds in H.
    destruct (nth_error c (number q)) as [p|] eqn:E; [|discriminate].
    apply andb_prop in H as [D H]; apply Z.ltb_lt, IZR_lt in D; rewrite forallb_forall in H.
    destruct (K _ _ E) as (NE & U & V); apply IZR_lt in U.
    set (u := (x - a) / (b - a)).
    assert (Hu : 0 <= u <= 1).
    { unfold u; split.
      - apply Rmult_le_pos; [lra | apply Rlt_le, Rinv_0_lt_compat; lra].
      - apply Rmult_le_reg_r with (b - a); [lra|]; unfold Rdiv; rewrite Rmult_assoc, Rinv_l; lra. }
    specialize (V u Hu); replace (a + u * (b - a)) with x in V by (unfold u; field; lra).
    set (e := fun n => (if turned q then -1 else 1) * (coefficient (row p) n * IZR (den q) - IZR (num q) * IZR (unit p))).
    assert (B : bern (degree (row p)) e (1 - u) u =
      (if turned q then -1 else 1) * (IZR (unit p) * f (number q) x * IZR (den q) - IZR (num q) * IZR (unit p))).
    { unfold e; rewrite bern_scale, (bern_minus _ (fun n => coefficient (row p) n * IZR (den q)) (fun _ => _)).
      rewrite bern_const by lra; f_equal; f_equal.
      rewrite (bern_ext _ _ (fun n => IZR (den q) * coefficient (row p) n)) by (intros; ring).
      rewrite bern_scale; fold (value (row p) (1 - u) u); rewrite V; ring. }
    assert (C : forall n, (n <= degree (row p))%nat -> In (nth n (row p) 0%Z) (row p)).
    { intros n Hn; apply nth_In; unfold degree in Hn; destruct (row p); [congruence | cbn in *; lia]. }
    assert (S : forall n, IZR (excess p q (nth n (row p) 0%Z)) = e n).
    { intros n; unfold excess, e, coefficient; destruct (turned q);
        rewrite ?opp_IZR, minus_IZR, !mult_IZR; ring. }
    assert (Q : forall s, IZR (unit p) * f (number q) x * IZR (den q) - IZR (num q) * IZR (unit p) = s ->
      f (number q) x - IZR (num q) / IZR (den q) = s / (IZR (unit p) * IZR (den q)))
      by (intros s <-; field; lra).
    specialize (Q _ eq_refl); set (s := IZR (unit p) * f (number q) x * IZR (den q) - IZR (num q) * IZR (unit p)) in *.
    assert (P : 0 < / (IZR (unit p) * IZR (den q))) by (apply Rinv_0_lt_compat, Rmult_lt_0_compat; auto).
    unfold Rdiv in Q at 2; unfold atom_true; destruct (strict q) eqn:St.
    - assert (Z : 0 < bern (degree (row p)) e (1 - u) u).
      { apply bern_positive; try lra; intros n Hn; rewrite <- S; apply IZR_lt, Z.ltb_lt; apply (H _ (C n Hn)). }
      rewrite B in Z; destruct (turned q); nra.
    - assert (Z : 0 <= bern (degree (row p)) e (1 - u) u).
      { apply bern_nonneg; try lra; intros n Hn; rewrite <- S; apply IZR_le, Z.leb_le; apply (H _ (C n Hn)). }
      rewrite B in Z; destruct (turned q); nra.
  Qed.

  Lemma rule_sound : forall q a b c x, a < b -> forms_known a b c -> a <= x <= b ->
    rule_holds q c = true -> rule_true q x.
  Proof.
    intros q a b c x L K X H; apply existsb_exists in H as (way & W & H); exists way; split; auto.
    rewrite forallb_forall in H; intros clause C; apply H, existsb_exists in C as (k & Ik & A).
    exists k; split; auto; apply (atom_sound a b c); auto.
  Qed.

  Lemma forms_cut : forall (h : form -> form) a b a' b' c,
    (forall p g, form_is p g a b -> form_is (h p) g a' b') ->
    forms_known a b c -> forms_known a' b' (map h c).
  Proof.
    intros h a b a' b' c H K k q N; rewrite nth_error_map in N.
    destruct (nth_error c k) as [q0|] eqn:E; [|discriminate]; injection N as <-; apply H, (K k q0 E).
  Qed.

  Theorem check_rules_sound : forall c steps leaves, forms_known 0 1 c ->
    check_rules r c steps = Some leaves -> tiles mark mark_true 0 1 leaves.
  Proof.
    intros c steps leaves K H.
    apply (check_tree_sound _ _ (map first_of) (map second_of) (claimed r) forms_known mark_true) with c steps; auto.
    - intros a b d; apply forms_cut; intros; apply first_is; auto.
    - intros a b d; apply forms_cut; intros; apply second_is; auto.
    - intros [| | |] a b d L Kd Hd; cbn in *; auto; intros x X; eapply rule_sound; eauto.
  Qed.
End Rules.
